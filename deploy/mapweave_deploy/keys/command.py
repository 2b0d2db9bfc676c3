"""``mapweave keys``: certificates for a team, and what the router lets each of them do."""

import argparse
import ipaddress
import re
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path

from mapweave.cli import Command, add_json_argument, argument, say, whole
from mapweave.errors import MissingExtraError
from mapweave_protocol.link.security.roster import Roster

DEFAULT_DAYS = 365
MOST_DAYS = 36_500  # a certificate cannot say a year of five digits
_NAME = re.compile(r"(?=.{1,253}$)[a-z0-9_-]{1,63}(\.[a-z0-9_-]{1,63})*", re.IGNORECASE)


def _configure(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("team", metavar="TEAM", help="the team's id")
    roles = (
        ("--robots", "each publishes its own map, and nothing else"),
        ("--operators", "each may mark, pin, forbid and forget"),
        ("--viewers", "each may look"),
    )
    for option, may in roles:
        parser.add_argument(option, nargs="+", default=[], metavar="ID", help=f"ids; {may}")
    parser.add_argument(
        "--hosts",
        nargs="+",
        type=argument(host),
        default=[],
        metavar="HOST",
        help="names and addresses of the router's machine, as others reach it",
    )
    parser.add_argument(
        "--page",
        nargs="+",
        type=argument(host),
        default=[],
        metavar="HOST",
        help="names and addresses of the coordinator's machine, for a page that others reach",
    )
    parser.add_argument(
        "--days",
        type=argument(days),
        default=DEFAULT_DAYS,
        metavar="N",
        help=f"how long the certificates are valid (default {DEFAULT_DAYS})",
    )
    add_json_argument(parser)
    parser.add_argument(
        "--output", type=Path, metavar="DIR", help="where to write (default keys-TEAM)"
    )


def host(text: str) -> str:
    """Return the name or address of a machine that `text` says, as certificates name it.

    Raises
    ------
    ValueError
        If it is neither.
    """
    try:
        return str(ipaddress.ip_address(text.removeprefix("[").removesuffix("]")))
    except ValueError as error:
        if not _NAME.fullmatch(text):
            expected = "expected a name such as base.local, or an address such as 192.168.1.10"
            raise ValueError(f"{text}: {expected}") from error
    return text


def days(text: str) -> int:
    """Return how many days `text` says; ValueError where that is no time for a certificate."""
    count = whole(text)
    if count > MOST_DAYS:
        raise ValueError(f"{text}: expected at most {MOST_DAYS} days")
    return count


def _run(options: argparse.Namespace) -> int:
    roster = Roster(
        options.team, tuple(options.robots), tuple(options.operators), tuple(options.viewers)
    )
    folder = options.output or Path(f"keys-{roster.team}")
    made = list(_made(roster, folder, options))
    content = {"folder": str(folder), "made": made}
    say(options, content, [f"{folder}: keys for {', '.join(made) if made else 'nobody new'}"])
    return 0


def _made(roster: Roster, folder: Path, options: argparse.Namespace) -> Iterator[str]:
    try:
        from mapweave_deploy.keys.team_keys import make_keys
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] != "cryptography":
            raise
        raise MissingExtraError("keys", "tls") from error
    now = datetime.now(UTC)
    return make_keys(roster, folder, now, options.days, options.hosts, options.page)


command = Command(
    "Make the certificates of a team, and its router's rules.",
    _configure,
    _run,
    "rescue --robots r1 r2 --operators anna --viewers screen",
)
