"""The arguments that all commands of the service have in common."""

import argparse
import logging
import os
from pathlib import Path

from mapweave.ids import check_id
from mapweave.text import shown
from mapweave_protocol.link.security.membership import check_team
from mapweave_protocol.link.security.settings import TLS_VARIABLE, ZENOH_VARIABLE, LinkSettings
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
    add_link_arguments(parser)


def add_link_arguments(parser: argparse.ArgumentParser) -> None:
    """Add ``--tls`` and ``--zenoh-config``; read them with `link_of`."""
    parser.add_argument(
        "--tls",
        type=Path,
        metavar="DIR",
        help=f"the keys of this program, as mapweave keys made them (default ${TLS_VARIABLE})",
    )
    parser.add_argument(
        "--zenoh-config",
        type=Path,
        metavar="FILE",
        help=f"settings of Zenoh, taken as far as they undo nothing (default ${ZENOH_VARIABLE})",
    )


def link_of(options: argparse.Namespace) -> LinkSettings:
    """Return the keys and settings that `options` and the environment name.

    Raises
    ------
    FileError
        If there is no folder of keys.
    """
    named = LinkSettings.of_environment({} if options.tls and options.zenoh_config else os.environ)
    if options.tls:
        named = LinkSettings.of(options.tls, named.extra)
    return LinkSettings(named.keys, options.zenoh_config or named.extra)


def tell_waiting(log: logging.Logger, reason: str) -> None:
    """Log why there is no router to be reached yet."""
    log.info("waiting for a router: %s", shown(reason, 300))


def connection_of(options: argparse.Namespace) -> tuple[str, tuple[str, ...], LinkSettings]:
    """Return the team's id, the endpoints, and the keys and settings that `options` say.

    Raises
    ------
    InvalidIdError
        If the team's id is none.
    FileError
        If there is no folder of keys.
    WrongKeysError
        If the keys are of another team.
    """
    link = link_of(options)
    endpoints = options.connect or default_endpoints(encrypted=link.keys is not None)
    team = check_id("team", options.team)
    check_team(link, team)
    return team, tuple(endpoints), link
