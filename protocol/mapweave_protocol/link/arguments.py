"""The arguments that all commands of the service have in common."""

import argparse

from mapweave.ids import check_id
from mapweave_protocol.link.session import DEFAULT_ENDPOINT, ENDPOINT_VARIABLE, default_endpoints

DEFAULT_TEAM = "team"


def add_connection_arguments(parser: argparse.ArgumentParser) -> None:
    """Add ``--team`` and ``--connect``; read them with `connection_of`."""
    parser.add_argument(
        "--team", default=DEFAULT_TEAM, metavar="T", help=f"the team's id (default {DEFAULT_TEAM})"
    )
    parser.add_argument(
        "--connect",
        action="append",
        metavar="ENDPOINT",
        help="where the router is; give several to fall back on"
        f" (default ${ENDPOINT_VARIABLE} or {DEFAULT_ENDPOINT})",
    )


def connection_of(options: argparse.Namespace) -> tuple[str, tuple[str, ...]]:
    """Return the team's id and the endpoints that `options` say.

    Raises
    ------
    InvalidIdError
        If the team's id is none.
    """
    return check_id("team", options.team), tuple(options.connect or default_endpoints())
