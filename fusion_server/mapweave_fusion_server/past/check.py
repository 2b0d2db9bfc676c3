"""``mapweave check``: whether a store is whole."""

import argparse
from collections.abc import Iterator

from mapweave.cli import EXIT_FAILED, Command, add_json_argument, say
from mapweave_fusion_server.past.arguments import add_store_arguments, store_of
from mapweave_fusion_server.storage.view import StoreView
from mapweave_protocol.errors import MessageError
from mapweave_protocol.wire.codec import decode
from mapweave_protocol.wire.messages import (
    AlignmentMessage,
    JointMapMessage,
    MapMessage,
    MarksMessage,
    OrderMessage,
)
from mapweave_protocol.wire.model import Message

KINDS: dict[str, type[Message]] = {
    "version": JointMapMessage,
    "alignment": AlignmentMessage,
    "robot_map": MapMessage,
    "mark": MarksMessage,
    "operator_order": OrderMessage,
}


def _configure(parser: argparse.ArgumentParser) -> None:
    add_store_arguments(parser)
    add_json_argument(parser)


def _run(options: argparse.Namespace) -> int:
    with store_of(options) as view:
        problems = [*view.problems()] or [*_unreadable(view)]
        first, last = view.numbers
    content = {"store": str(view.path), "versions": [first, last], "problems": problems}
    told = problems or [f"whole, versions {first} to {last}"]
    say(options, content, [f"{view.path}: {line}" for line in told])
    return EXIT_FAILED if problems else 0


def _unreadable(view: StoreView) -> Iterator[str]:
    for table, kind in KINDS.items():
        for row, message in view.messages(table):
            try:
                decode(kind, message)
            except MessageError as error:
                yield f"row {row} of {table}: {error}"


command = Command("Check whether a store is whole.", _configure, _run, "--team rescue")
