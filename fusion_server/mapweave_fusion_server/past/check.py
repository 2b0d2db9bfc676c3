"""``mapweave check``: whether a store is whole."""

import argparse
from collections.abc import Iterator

from mapweave.cli import EXIT_FAILED, Command
from mapweave_fusion_server.past.arguments import add_store_arguments, store_of
from mapweave_fusion_server.storage.view import StoreView
from mapweave_protocol.errors import MessageError
from mapweave_protocol.wire.codec import decode
from mapweave_protocol.wire.messages import AlignmentMessage, JointMapMessage, MapMessage
from mapweave_protocol.wire.model import Message

KINDS: dict[str, type[Message]] = {
    "version": JointMapMessage,
    "alignment": AlignmentMessage,
    "robot_map": MapMessage,
}


def _configure(parser: argparse.ArgumentParser) -> None:
    add_store_arguments(parser)


def _run(options: argparse.Namespace) -> int:
    with store_of(options) as view:
        problems = [*view.problems()] or [*_unreadable(view)]
        for problem in problems:
            print(f"{view.path}: {problem}")  # noqa: T201
        first, last = view.numbers
    if problems:
        return EXIT_FAILED
    print(f"{view.path}: whole, versions {first} to {last}")  # noqa: T201
    return 0


def _unreadable(view: StoreView) -> Iterator[str]:
    for table, kind in KINDS.items():
        for row, message in view.messages(table):
            try:
                decode(kind, message)
            except MessageError as error:
                yield f"row {row} of {table}: {error}"


command = Command("Check whether a store is whole.", _configure, _run, "--team rescue")
