"""``mapweave server``: the coordinator of a team."""

import argparse
import gc
import logging
import math
import os
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from functools import partial
from pathlib import Path

from mapweave.cli import (
    Command,
    add_config_argument,
    argument,
    config_of,
    not_negative,
    positive,
    whole,
)
from mapweave.config import Config
from mapweave_fusion_server.coordinator import CoordinatorParameters
from mapweave_fusion_server.past.arguments import default_store
from mapweave_fusion_server.service import Service
from mapweave_fusion_server.storage.retention import DAY, DEFAULT_VERSIONS, Retention
from mapweave_fusion_server.store import Store
from mapweave_fusion_server.web.address import (
    TOKEN_VARIABLE,
    HttpAddress,
    http_address,
    new_token,
    with_keys,
)
from mapweave_fusion_server.web.feed import Feed
from mapweave_fusion_server.web.loading import live_page
from mapweave_protocol.link.arguments import (
    add_connection_arguments,
    connection_of,
    tell_waiting,
)
from mapweave_protocol.link.security.membership import check_member
from mapweave_protocol.link.security.roster import Member, Role
from mapweave_protocol.link.session import open_session
from mapweave_protocol.link.stopping import StopSignals
from mapweave_protocol.narration.logs import add_log_arguments, begin_log

DEFAULT_INTERVAL: float = CoordinatorParameters().min_interval

_log = logging.getLogger(__name__)


def _configure(parser: argparse.ArgumentParser) -> None:
    add_connection_arguments(parser)
    add_log_arguments(parser)
    add_config_argument(parser)
    parser.add_argument(
        "--store",
        type=Path,
        metavar="FILE",
        help="what is remembered; numbering goes on from there (default mapweave-TEAM.sqlite)",
    )
    parser.add_argument(
        "--http",
        type=argument(http_address),
        metavar="HOST:PORT",
        help="serve the live page there, such as 127.0.0.1:8080; with --tls, to other machines too",
    )
    parser.add_argument(
        "--min-interval",
        type=argument(not_negative),
        default=DEFAULT_INTERVAL,
        metavar="S",
        help="least time between two versions [s] unless maps are joined or parted"
        f" (default {DEFAULT_INTERVAL:g})",
    )
    _add_retention_arguments(parser)


def _add_retention_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--keep-versions",
        type=argument(whole),
        default=DEFAULT_VERSIONS,
        metavar="N",
        help=f"how many versions the store keeps (default {DEFAULT_VERSIONS})",
    )
    parser.add_argument(
        "--keep-days",
        type=argument(positive),
        default=math.inf,
        metavar="D",
        help="how long it keeps them [days] (default: for good); the latest stays",
    )


def _run(options: argparse.Namespace) -> int:
    begin_log(options, "coordinator")
    team, endpoints, link = connection_of(options)
    check_member(link, Member(team, Role.COORDINATOR, Role.COORDINATOR.value))
    config = config_of(options)
    page = None if options.http is None else with_keys(options.http, link.keys)
    parameters = CoordinatorParameters(min_interval=options.min_interval)
    path = options.store or default_store(team)
    retention = Retention(options.keep_versions, options.keep_days * DAY)

    with (
        Store(path, team, retention) as store,
        _page(page, team, store, config) as feed,
        open_session(endpoints, on_wait=partial(tell_waiting, _log), link=link) as session,
        nullcontext() if feed is None else feed.positions.heard_on(session, team),
    ):
        gc.freeze()  # what was loaded stays: collections, in which all waits, need not look at it
        Service(session, team, store, parameters, config, feed, link).run(StopSignals())
    return 0


@contextmanager
def _page(
    address: HttpAddress | None, team: str, store: Store, config: Config
) -> Iterator[Feed | None]:
    """Serve the live page in the block, where an address is given; give what feeds it."""
    if address is None:
        yield None
        return
    feed, token = Feed(), os.environ.get(TOKEN_VARIABLE) or new_token()
    with live_page()(address, team, store, config, feed, token) as bound:
        _log.info("live page: %s", bound.url(token))
        yield feed


command = Command(
    "Coordinate a team: maps and alignments in, joint maps out.",
    _configure,
    _run,
    "--team rescue --store rescue.sqlite",
)
