"""Processor time per stage, by beams, segments and robots, beside what a user would take."""

import argparse
from pathlib import Path

from benchmarks.speed.comparisons import measure_pairs, measure_segments
from benchmarks.speed.programs import measure_agent, measure_before, measure_starts
from benchmarks.speed.rows import Report
from benchmarks.speed.scans import measure_beams, measure_log, measure_lost
from benchmarks.speed.versions import measure_versions
from benchmarks.tables import OUTPUT

PARTS = ("scans", "beams", "lost", "comparisons", "segments", "versions", "programs")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Say what is measured, on how much, and where it goes."""
    parser.add_argument(
        "--only", nargs="+", choices=PARTS, default=PARTS, help="parts of it (default all)"
    )
    parser.add_argument("--log", default="fr079", metavar="NAME", help="mapped (%(default)s)")
    parser.add_argument(
        "--scans", type=int, default=600, metavar="N", help="of it, 0 for all (%(default)s)"
    )
    parser.add_argument(
        "--logs",
        nargs="+",
        default=["seattle", "intel"],
        metavar="NAME",
        help="cut up and compared (seattle intel)",
    )
    parser.add_argument(
        "--stretches", type=int, nargs="+", default=[6, 12], metavar="N", help="cuts (6 12)"
    )
    parser.add_argument(
        "--before", metavar="COMMIT", help="measure its mapweave map as well: takes minutes"
    )
    parser.add_argument(
        "--report-only", action="store_true", help="exit status 0, whatever is reached"
    )
    parser.add_argument("--output", type=Path, default=OUTPUT / "speed.json", help="(%(default)s)")


def run(options: argparse.Namespace) -> None:
    """Measure, print the table, write the JSON.

    Raises
    ------
    SystemExit
        With status 1 if a figure falls short, unless only a report was asked for.
    """
    report = Report()
    _measure_scans(report, options)
    if "comparisons" in options.only:
        measure_pairs(report, options.logs, options.stretches)
    if "segments" in options.only:
        measure_segments(report)
    if "versions" in options.only:
        measure_versions(report)
    if "programs" in options.only:
        measure_starts(report, options.log)
        measure_agent(report, options.log, options.scans)
    report.write(options.output)
    print(f"\n{report.tell()}\n\nAll of it is in {options.output}")
    if not options.report_only and not all(figure.is_met for figure in report.figures):
        raise SystemExit(1)


def _measure_scans(report: Report, options: argparse.Namespace) -> None:
    if "scans" in options.only:
        now = measure_log(report, options.log, options.scans)
        if options.before and now is not None:
            measure_before(report, options.before, options.log, options.scans, now)
    if "beams" in options.only:
        measure_beams(report, min(options.scans or 300, 300))
    if "lost" in options.only:
        measure_lost(report, options.scans)
