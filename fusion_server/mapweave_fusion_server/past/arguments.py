"""Which store is read."""

import argparse
from datetime import UTC, datetime
from pathlib import Path

from mapweave.cli import whole
from mapweave.errors import FileError
from mapweave.ids import check_id
from mapweave.maps import Alignment, JointMap
from mapweave_fusion_server.storage.view import StoreView
from mapweave_protocol.errors import MessageError
from mapweave_protocol.link.arguments import DEFAULT_TEAM
from mapweave_protocol.wire.codec import decode
from mapweave_protocol.wire.messages import JointMapMessage

LATEST = "latest"


def add_store_arguments(parser: argparse.ArgumentParser) -> None:
    """Add ``--store`` and ``--team``; read them with `store_of`."""
    parser.add_argument(
        "--team",
        metavar="T",
        help=f"the team's id (default whose the store is; without --store {DEFAULT_TEAM})",
    )
    parser.add_argument(
        "--store", type=Path, metavar="FILE", help="the store (default mapweave-TEAM.sqlite)"
    )


def store_of(options: argparse.Namespace) -> StoreView:
    """Open the store that `options` say.

    Raises
    ------
    FileError
        If there is none, or it is another team's.
    """
    team = None if options.team is None else check_id("team", options.team)
    return StoreView(options.store or default_store(team or DEFAULT_TEAM), team)


def default_store(team: str) -> Path:
    """Return where a coordinator keeps its store unless told."""
    return Path(f"mapweave-{team}.sqlite")


def version_number(text: str) -> int:
    """Return the number that `text` says, 0 for the latest; ValueError otherwise."""
    if text == LATEST:
        return 0
    try:
        return whole(text)
    except ValueError as error:
        raise ValueError(f"{text}: expected the number of a version, or {LATEST}") from error


def joint_of(view: StoreView, number: int) -> JointMap:
    """Return version `number`, the latest if that is 0.

    Raises
    ------
    FileError
        If there is none, or it cannot be read.
    """
    wanted = number or view.numbers[1]
    try:
        return decode(JointMapMessage, view.version(wanted)).unpack()
    except MessageError as error:
        raise FileError(view.path, f"version {wanted}: {error}") from error


def judgement(alignment: Alignment) -> str:
    """Return what was decided of an alignment, and what became of it."""
    if alignment.status is None:
        return alignment.decision
    return f"{alignment.decision}, {alignment.status.kind.value.replace('_', ' ')}"


def tell_time(seconds: float | None) -> str:
    """Return a time [s since 1970] for a person."""
    if seconds is None:
        return "unknown"
    try:
        return datetime.fromtimestamp(seconds, UTC).strftime("%Y-%m-%d %H:%M:%S")
    except (ValueError, OverflowError, OSError):  # a clock that says nothing
        return "unknown"
