"""``mapweave backup``: a copy of a store, while the server goes on."""

import argparse
from pathlib import Path

from mapweave.atomic import check_outputs
from mapweave.cli import Command, add_json_argument, say
from mapweave_fusion_server.past.arguments import add_store_arguments, store_of


def _configure(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("copy", type=Path, metavar="FILE", help="the copy")
    add_store_arguments(parser)
    add_json_argument(parser)


def _run(options: argparse.Namespace) -> int:
    with store_of(options) as view:
        check_outputs([options.copy], [view.path])
        view.backup(options.copy)
        first, last = view.numbers
        content = {"versions": [first, last], "copy": str(options.copy)}
        say(options, content, [f"versions {first} to {last}, in {options.copy}"])
    return 0


command = Command(
    "Copy a store, also while the server uses it.", _configure, _run, "copy.sqlite --team rescue"
)
