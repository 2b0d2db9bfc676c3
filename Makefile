# Everything builds .venv first when it is missing or stale: Python 3.11 and make are all it takes.
PYTHON ?= python3
BIN := .venv/bin
STAMP := .venv/.installed
KERNELS := .venv/.kernels

WHEEL_BIN := .venv-wheel/bin
PACKAGES := mapweave protocol ros agent fusion_server deploy
SOURCES := pyproject.toml README.md LICENSE \
	$(shell find $(PACKAGES) -name __pycache__ -prune -o -print)
# PYTHONSAFEPATH: programs that tests start import the wheel as well, not the checkout.
TEST_WHEEL := PYTHONSAFEPATH=1 MAPWEAVE_INSTALLED=1 $(WHEEL_BIN)/pytest -n 2

.PHONY: demo test test-all quick matrix durations lint format wheel bench bench-map bench-fusion
.PHONY: bench-speed bench-faults bench-live bench-page bench-robots bench-shape
.PHONY: clean distclean mutations

$(STAMP): pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
		{ echo "mapweave needs Python 3.11 or newer; name one with: make PYTHON=python3.12" >&2; exit 1; }
	$(PYTHON) -m venv --clear .venv
	$(BIN)/python -m pip install --quiet --disable-pip-version-check \
		--config-settings=wheel.cmake=false --editable '.[dev]'
	@touch $@

# Compiled when they are needed, and when their sources change; where nothing can be compiled,
# NumPy does their work. The checks of make test need none: its tests run the wheel.
$(KERNELS): $(STAMP) mapweave/kernels/CMakeLists.txt $(wildcard mapweave/kernels/*.[ch]pp)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --editable .
	@touch $@

demo: $(KERNELS)
	$(BIN)/mapweave team --world office --robots 3 --output demo --http 127.0.0.1:0

lint: $(STAMP)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/mypy tests tools benchmarks
	$(BIN)/mypy examples/*.py
	$(BIN)/lint-imports

format: $(STAMP)
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

dist/.built: $(STAMP) $(SOURCES)
	rm -rf dist
	$(BIN)/python -m build --quiet
	@touch $@

wheel: dist/.built

.venv-wheel/.installed: dist/.built
	$(BIN)/python -m tools.wheel_environment .venv-wheel
	@touch $@

# Side by side, the checks and the wheel take little longer than one of them.
CHECKED_AND_BUILT = $(MAKE) --no-print-directory --jobs=2 --output-sync lint .venv-wheel/.installed

test: $(STAMP)
	+$(CHECKED_AND_BUILT)
	$(TEST_WHEEL) -m 'not slow'

test-all: $(STAMP)
	+$(CHECKED_AND_BUILT)
	$(TEST_WHEEL)

quick: $(KERNELS)
	$(BIN)/python -m tools.quick $(BASE)

matrix: dist/.built
	$(BIN)/python -m tools.matrix

durations: .venv-wheel/.installed
	$(TEST_WHEEL) -q -m 'not slow' --junitxml=.pytest_cache/durations.xml
	$(BIN)/python -m tools.durations .pytest_cache/durations.xml

mutations: $(KERNELS)
	$(BIN)/python -m benchmarks mutations

bench: $(KERNELS)
	$(BIN)/python -m benchmarks

.PHONY: bench-wire
bench-wire: $(KERNELS)
	$(BIN)/python -m benchmarks wire

# A minute for each reader and decoder: SECONDS=600 for longer, TARGETS="bag keys" for some.
.PHONY: fuzz
fuzz: $(KERNELS)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check 'atheris>=3'
	$(BIN)/python -m tests.fuzz --seconds $(or $(SECONDS),60) $(TARGETS)

.PHONY: docs
docs: $(KERNELS)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[docs]'
	$(BIN)/sphinx-build --quiet --fresh-env --fail-on-warning --keep-going docs/reference site

bench-map: $(KERNELS)
	$(BIN)/python -m benchmarks map
	$(BIN)/python -m benchmarks kidnap

bench-live: $(KERNELS)
	$(BIN)/python -m benchmarks live --seconds 600

bench-page: $(KERNELS)
	$(BIN)/python -m benchmarks page

bench-speed: $(KERNELS)
	$(BIN)/python -m benchmarks speed

bench-robots: $(KERNELS)
	$(BIN)/python -m benchmarks robots

bench-shape: $(KERNELS)
	$(BIN)/python -m benchmarks shape --stretches 3 6
	$(BIN)/python -m benchmarks scale
	for part in words correlation similarity; do \
	  $(BIN)/python -m benchmarks fusion --no-peers --across 0 --without $$part; done

# Which shapes buildings are full of, counted anew in all recordings.
.PHONY: background
background: $(KERNELS)
	$(BIN)/python -m benchmarks background

bench-fusion: $(KERNELS)
	$(BIN)/python -m benchmarks fusion

# An hour and more: hostile messages, outages, kills, lossy links, subscribers; SEEDS=5 for fewer outages,
# EVENTS=10 for fewer kills.
bench-faults: $(KERNELS)
	$(BIN)/python -m benchmarks hostile
	$(BIN)/python -m benchmarks outages --seeds $(or $(SEEDS),50)
	$(BIN)/python -m benchmarks kills --events $(or $(EVENTS),50)
	$(BIN)/python -m benchmarks lossy
	$(BIN)/python -m benchmarks subscribers
	$(BIN)/python -m benchmarks crowd

# What was made of the sources; results (demo, team, bench) stay.
clean:
	rm -rf .venv .venv-wheel .matrix dist site
	rm -rf .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

distclean: clean
	rm -rf demo team bench
