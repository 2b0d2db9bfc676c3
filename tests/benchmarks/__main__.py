"""``python -m tests.benchmarks [figure2 | map | fusion | …]``."""

import argparse

from tests.benchmarks import figure2, fusion, mapping

BENCHMARKS = {"figure2": figure2, "map": mapping, "fusion": fusion}


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks")
    commands = parser.add_subparsers(dest="benchmark")
    for name, module in BENCHMARKS.items():
        summary = (module.__doc__ or "").strip().partition("\n")[0]
        module.add_arguments(commands.add_parser(name, help=summary, description=summary))
    options = parser.parse_args()
    BENCHMARKS[options.benchmark].run(options)


if __name__ == "__main__":
    main()
