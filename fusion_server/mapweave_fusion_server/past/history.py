"""``mapweave history``: the versions that a store has."""

import argparse
import json
from collections.abc import Iterator

from mapweave.cli import Command, argument, whole
from mapweave.errors import FileError
from mapweave_fusion_server.past.arguments import (
    add_store_arguments,
    joint_of,
    store_of,
    tell_time,
)
from mapweave_fusion_server.storage.view import StoreView, VersionEntry
from mapweave_protocol.narration.story_joint import tell_components

DEFAULT_LIMIT = 20


def _configure(parser: argparse.ArgumentParser) -> None:
    add_store_arguments(parser)
    parser.add_argument(
        "--limit",
        type=argument(whole),
        default=DEFAULT_LIMIT,
        metavar="N",
        help=f"how many, of the last ones (default {DEFAULT_LIMIT})",
    )
    parser.add_argument("--json", action="store_true", help="one line of JSON for each version")


def _run(options: argparse.Namespace) -> int:
    with store_of(options) as view:
        for row in view.versions(options.limit):
            for line in _lines(view, row, as_json=options.json):
                print(line)  # noqa: T201
    return 0


def _lines(view: StoreView, row: VersionEntry, *, as_json: bool) -> Iterator[str]:
    try:
        told, groups = _told(view, row.number)
    except FileError as error:
        told, groups = error.problem, None
    if as_json:
        fields = {"version": row.number, "created": row.created, "bytes": row.size}
        yield json.dumps(fields | ({"damaged": told} if groups is None else {"components": groups}))
    else:
        yield f"{row.number:>6}  {tell_time(row.created)}  {row.size:>9} bytes  {told}"


def _told(view: StoreView, number: int) -> tuple[str, list[list[str]]]:
    joint = joint_of(view, number)
    return tell_components(joint), [sorted(component.robots) for component in joint.components]


command = Command(
    "List the versions that a store has.", _configure, _run, "--team rescue --limit 10"
)
