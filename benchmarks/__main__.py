"""``python -m benchmarks NAME``, such as ``map``; ``--help`` lists the names."""

import argparse
import io
import sys
import time
from typing import Protocol

from benchmarks import (
    across,
    background,
    day,
    endurance,
    figure2,
    fit_confidence,
    fusion,
    kidnap,
    live,
    localize,
    mapping,
    mutations,
    page,
    peers,
    reference,
    relocalize,
    robots,
    same_results,
    shape,
    signatures,
    sources,
    team,
    twins,
    usual_counts,
    wire,
)
from benchmarks.faults import crowd, hostile, kills, lossy, outages, subscribers
from benchmarks.scale import command as scale
from benchmarks.speed import command as speed
from mapweave.kernels.loading import missing


class Benchmark(Protocol):
    """What each module of a benchmark offers."""

    __doc__: str | None

    def add_arguments(self, parser: argparse.ArgumentParser) -> None:
        """Add its own arguments."""

    def run(self, options: argparse.Namespace) -> None:
        """Measure, print, write."""


BENCHMARKS: dict[str, Benchmark] = {
    "figure2": figure2,
    "map": mapping,
    "kidnap": kidnap,
    "localize": localize,
    "relocalize": relocalize,
    "live": live,
    "sources": sources,
    "endurance": endurance,
    "fusion": fusion,
    "across": across,
    "background": background,
    "reference": reference,
    "robots": robots,
    "peers": peers,
    "scale": scale,
    "shape": shape,
    "signatures": signatures,
    "same-results": same_results,
    "speed": speed,
    "team": team,
    "twins": twins,
    "confidence": fit_confidence,
    "wire": wire,
    "hostile": hostile,
    "usual-counts": usual_counts,
    "outages": outages,
    "kills": kills,
    "lossy": lossy,
    "subscribers": subscribers,
    "crowd": crowd,
    "page": page,
    "day": day,
    "mutations": mutations,
}
USUAL = ("figure2", "map", "kidnap", "localize", "fusion")


def main() -> None:
    """Run the benchmark that was asked for, or the usual ones one after the other."""
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(line_buffering=True)  # whoever follows a file sees how far it is
    if told := missing():
        print(told)
    parser = _parser()
    asked = [sys.argv[1:]] if len(sys.argv) > 1 else [[name] for name in USUAL]
    if len(asked) > 1:
        print(f"{', '.join(USUAL)}: an hour or more on two cores; one alone: name it")
    for arguments in asked:
        options = parser.parse_args(arguments)
        start = time.monotonic()
        BENCHMARKS[options.benchmark].run(options)
        print(f"{options.benchmark} took {time.monotonic() - start:.0f} s\n")


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m benchmarks")
    commands = parser.add_subparsers(dest="benchmark", required=True)
    for name, module in BENCHMARKS.items():
        summary = (module.__doc__ or "").partition("\n")[0]
        module.add_arguments(commands.add_parser(name, help=summary, description=summary))
    return parser


if __name__ == "__main__":
    main()
