"""Fuzz one target in this process: ``python -m tests.fuzz.one NAME SECONDS``; it ends with it."""

import sys
from pathlib import Path

import atheris

PACKAGES = ["mapweave", "mapweave_protocol"]
LONGEST = 20  # [s] that one input may take
MOST_MEMORY = 3000  # [MiB]

# An editable installation finds modules before Atheris does, which then watches none of them.
sys.meta_path[:] = [each for each in sys.meta_path if "editable" not in type(each).__module__]
with atheris.instrument_imports(include=PACKAGES):
    from tests.fuzz.targets import targets


def main(name: str, seconds: int, output: Path) -> None:
    """Fuzz the target of that name for so long; what breaks its rule is kept in `output`."""
    target, corpus = targets()[name], output / name
    corpus.mkdir(parents=True, exist_ok=True)
    for number, seed in enumerate(target.seeds):
        (corpus / f"seed-{number}").write_bytes(seed)
    limits = [f"-max_total_time={seconds}", f"-timeout={LONGEST}", f"-rss_limit_mb={MOST_MEMORY}"]
    told = ["-print_final_stats=1", f"-artifact_prefix={output}/broken-{name}-"]
    atheris.Setup([sys.argv[0], str(corpus), *limits, *told], target.rule)
    atheris.Fuzz()


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]), Path("bench") / "fuzz")
