# Everything builds .venv first when it is missing or stale: Python 3.11 and make are all it takes.
PYTHON ?= python3
BIN := .venv/bin
STAMP := .venv/.installed

.PHONY: demo test test-all lint mutations bench bench-map bench-fusion clean

$(STAMP): pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
		{ echo "mapweave needs Python 3.11 or newer; name one with: make PYTHON=python3.12" >&2; exit 1; }
	$(PYTHON) -m venv --clear .venv
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[dev]'
	@touch $@

demo: $(STAMP)
	$(BIN)/mapweave team --world office --robots 3 --output demo

lint: $(STAMP)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/mypy tests
	$(BIN)/lint-imports

test: lint
	$(BIN)/pytest -n 2 -m 'not slow'

test-all: lint
	$(BIN)/pytest -n 2

mutations: $(STAMP)
	$(BIN)/python -m benchmarks mutations

bench: $(STAMP)
	$(BIN)/python -m benchmarks

bench-map: $(STAMP)
	$(BIN)/python -m benchmarks map
	$(BIN)/python -m benchmarks kidnap

bench-fusion: $(STAMP)
	$(BIN)/python -m benchmarks fusion

clean:
	rm -rf .venv demo team bench .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
