"""``mapweave export``: a map file as a picture or as geometry for other programs."""

import argparse
from pathlib import Path

from mapweave.cli import Command, add_json_argument, say
from mapweave.commands.progress import busy
from mapweave.io.export import EXPORT_SUFFIXES, check_export_suffix, export
from mapweave.io.map_files import load


def _configure(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("map", metavar="MAP.json", type=Path, help="a robot's map or a joint map")
    parser.add_argument(
        "output",
        metavar="OUT",
        type=Path,
        help=f"the file to write, named {', '.join(f'*{suffix}' for suffix in EXPORT_SUFFIXES)}",
    )
    add_json_argument(parser)


def _run(options: argparse.Namespace) -> int:
    check_export_suffix(options.output)
    with busy(f"writing {options.output.name}"):
        export(load(options.map), options.output)
    say(options, {"output": str(options.output)}, [])
    return 0


command = Command(
    "Write a map as a picture, as geometry, as a grid or as a path.",
    _configure,
    _run,
    "r1.json r1.geojson",
)
