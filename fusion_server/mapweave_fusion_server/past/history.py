"""``mapweave history``: the versions that a store has."""

import argparse

from mapweave.cli import Command, add_json_argument, argument, say, whole
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
    add_json_argument(parser)


def _run(options: argparse.Namespace) -> int:
    with store_of(options) as view:
        for row in view.versions(options.limit):
            _tell(options, view, row)
    return 0


def _tell(options: argparse.Namespace, view: StoreView, row: VersionEntry) -> None:
    try:
        told, groups = _told(view, row.number)
    except FileError as error:
        told, groups = error.problem, None
    fields: dict[str, object] = {"damaged": told} if groups is None else {"components": groups}
    fields |= {"version": row.number, "created": row.created, "bytes": row.size}
    line = f"{row.number:>6}  {tell_time(row.created)}  {row.size:>9} bytes  {told}"
    say(options, fields, [line])


def _told(view: StoreView, number: int) -> tuple[str, list[list[str]]]:
    joint = joint_of(view, number)
    return tell_components(joint), [sorted(component.robots) for component in joint.components]


command = Command(
    "List the versions that a store has.", _configure, _run, "--team rescue --limit 10"
)
