"""What the commands of operators have in common."""

import argparse
import getpass
import os
import re
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import zenoh

from mapweave.cli import add_json_argument
from mapweave.errors import MapweaveError
from mapweave.geometry.arrays import FloatArray
from mapweave.ids import check_id
from mapweave.maps import parse_component
from mapweave.orders import MAX_REASON
from mapweave_protocol.link.arguments import add_connection_arguments, connection_of
from mapweave_protocol.link.security.membership import operator_of
from mapweave_protocol.link.security.proof import Sign, signing
from mapweave_protocol.link.session import open_session
from mapweave_protocol.operator.delivery import PATIENCE
from mapweave_protocol.wire.model import ORDER_REACH

NAME_VARIABLE = "MAPWEAVE_OPERATOR"
_NUMBER = r"[-+]?[0-9]{1,9}(?:\.[0-9]{0,9})?"


def add_order_arguments(parser: argparse.ArgumentParser, taken_back: str) -> None:
    """Add ``--as``, ``--json``, ``--undo`` and those of the connection.

    Parameters
    ----------
    taken_back
        What ``--undo`` takes back, in words.
    """
    parser.add_argument(
        "--as",
        dest="name",
        metavar="NAME",
        help=f"who orders it (default ${NAME_VARIABLE}, whose keys they are, or the login name)",
    )
    add_json_argument(parser)
    parser.add_argument("--undo", action="store_true", help=f"take back {taken_back}")
    add_connection_arguments(parser)


def add_reason_argument(parser: argparse.ArgumentParser) -> None:
    """Add ``--reason``."""
    parser.add_argument(
        "--reason", required=True, type=_reason, metavar="TEXT", help="why; the joint map says so"
    )


@contextmanager
def connected(options: argparse.Namespace) -> Iterator[tuple[zenoh.Session, str, str, Sign]]:
    """Give a session, the team, the operator's name, and what signs orders in that.

    Raises
    ------
    InvalidIdError
        If that is no id.
    WrongKeysError
        If the keys are not an operator's, or another one's.
    FileError, MissingExtraError
        If the keys cannot be used, or what signs is not installed.
    UnreachableError
        If no router answers for some seconds.
    """
    team, endpoints, link = connection_of(options)
    given = operator_of(link, options.name or os.environ.get(NAME_VARIABLE))
    name = check_id("operator", given or getpass.getuser().lower())
    sign = signing(link)
    with open_session(endpoints, patience=PATIENCE, link=link) as session:
        yield session, team, name, sign


def component(text: str) -> str:
    """Return the name of a component that `text` is.

    Raises
    ------
    ValueError
        If it is none.
    """
    try:
        robot, at, boot = parse_component(text)[0].partition("@")
        check_id("robot", robot)
        if at:
            check_id("boot", boot)
    except MapweaveError as error:
        raise ValueError(str(error)) from error
    return text


def transform(text: str) -> FloatArray:
    """Return the (3,) transform [m, m, rad] that `text` gives in metres and degrees.

    Raises
    ------
    ValueError
        If it is none.
    """
    if not re.fullmatch(f"{_NUMBER},{_NUMBER},{_NUMBER}", text):
        raise ValueError(f"{text}: expected x,y,degrees [m, m, °], such as 3.5,-1,90")
    x, y, degrees = (float(number) for number in text.split(","))
    return np.array([*_within_reach(text, x, y), np.radians(degrees % 360)])


def scan_or_place(text: str) -> int | FloatArray:
    """Return the number of a scan, or the (2,) place [m] that `text` gives.

    Raises
    ------
    ValueError
        If it is neither.
    """
    if re.fullmatch(r"[0-9]{1,15}", text):
        return int(text)
    if not re.fullmatch(f"{_NUMBER},{_NUMBER}", text):
        raise ValueError(f"{text}: expected the number of a scan, or x,y [m], such as 3.5,-1")
    return np.array(_within_reach(text, *map(float, text.split(","))))


def _within_reach(text: str, x: float, y: float) -> tuple[float, float]:
    if max(abs(x), abs(y)) > ORDER_REACH:
        raise ValueError(f"{text}: expected places at most {ORDER_REACH:g} m away")
    return x, y


def _reason(text: str) -> str:
    if not (text.isprintable() and text.strip() and len(text) <= MAX_REASON):
        raise argparse.ArgumentTypeError(f"expected 1 to {MAX_REASON} printable characters")
    return text
