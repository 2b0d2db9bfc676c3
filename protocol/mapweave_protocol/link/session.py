"""Zenoh as mapweave wants it: the configuration of sessions and of the router, and the QoS.

Everybody is a client of a router: it forwards between clients, and a stuck client harms nobody
else. Publishers drop rather than wait for a slow receiver; what is lost is fetched from the
publisher's cache.
"""

import json
import os
import re
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Literal, TypeAlias

import zenoh
import zenoh.ext as ze

from mapweave_protocol.errors import EndpointError, NotEncryptedError, UnreachableError
from mapweave_protocol.link.assembler import MESSAGES_TO_COMPLETE
from mapweave_protocol.link.guard.deaf_link import mending_deaf_links
from mapweave_protocol.link.reasons import reason_of
from mapweave_protocol.link.security.access import access_rules, size_limits
from mapweave_protocol.link.security.settings import LinkSettings
from mapweave_protocol.wire.codec import MAX_PAYLOAD

DEFAULT_ENDPOINT = "tcp/localhost:7447"
ENCRYPTED_ENDPOINT = "tls/localhost:7447"
ENDPOINT_VARIABLE = "MAPWEAVE_CONNECT"
ATTEMPT = 1.0  # [s] one attempt to connect; between attempts, Ctrl-C is heard
PAUSE = 0.2  # [s] between attempts
# Also after a long outage the link is back soon after the router can be reached.
RETRY = {"period_init_ms": 250, "period_max_ms": 500, "period_increase_factor": 2}
LEASE = 5.0  # [s] after which a robot that fell silent counts as gone
HEARTBEAT = 0.5  # [s] after which the loss of a publisher's last sample is noticed

# Zenoh would go on trying one that no transport of its own knows.
_ENDPOINT = re.compile(r"(tcp|udp|tls|quic|ws)/[^\s/]+:([0-9]{1,5})([#?]\S*)?")
MAX_PORT = 65535

Mode: TypeAlias = Literal["client", "peer"]
OnSample: TypeAlias = Callable[[zenoh.Sample], None]


def default_endpoints(*, encrypted: bool = False) -> tuple[str, ...]:
    """Return where the router is: from ``MAPWEAVE_CONNECT``, comma-separated, or this machine."""
    words = os.environ.get(ENDPOINT_VARIABLE, "").split(",")
    here = ENCRYPTED_ENDPOINT if encrypted else DEFAULT_ENDPOINT
    return tuple(word.strip() for word in words if word.strip()) or (here,)


def session_config(
    endpoints: Sequence[str], mode: Mode = "client", link: LinkSettings | None = None
) -> zenoh.Config:
    """Return the configuration of a session that connects to `endpoints`.

    Raises
    ------
    EndpointError
        If one is not an endpoint such as ``tcp/localhost:7447``, or not encrypted where it has to
        be.
    FileError
        If a configuration that a user adds cannot be taken.
    """
    link = link or LinkSettings()
    settings = _common_settings(link) | {
        "mode": mode,
        "connect/endpoints": list(endpoints),
        "connect/timeout_ms": int(ATTEMPT * 1000),
        "connect/exit_on_failure": True,
        "connect/retry": RETRY,
    }
    return _config(settings, endpoints, link)


def router_config(
    listen: Sequence[str], link: LinkSettings | None = None, connect: Sequence[str] = ()
) -> zenoh.Config:
    """Return the configuration of a router that listens at the endpoints `listen`.

    Parameters
    ----------
    link
        With keys, only members of the team are let in, each to what is its own.
    connect
        Where other routers listen: who is at any of them reaches who is at another.

    Raises
    ------
    EndpointError
        If one is not an endpoint such as ``tcp/0.0.0.0:7447``.
    FileError
        If a configuration that a user adds cannot be taken.
    """
    link = link or LinkSettings()
    settings = _common_settings(link) | {
        "mode": "router",
        "listen/endpoints": list(listen),
        "listen/exit_on_failure": True,
        "connect/endpoints": list(connect),
        "connect/timeout_ms": -1,  # tried for ever, beside what it does
        "connect/exit_on_failure": False,
        "connect/retry": RETRY,
        "scouting/delay": 0,
        # With the defaults, 100 idle connections keep newcomers out for 11 s.
        "transport/unicast/accept_timeout": 1000,
        "transport/unicast/accept_pending": 500,
    }
    if link.keys is not None:
        settings["access_control"] = access_rules(link.keys.roster)
        settings["low_pass_filter"] = size_limits(link.keys.roster.team)
    return _config(settings, (*listen, *connect), link)


def _common_settings(link: LinkSettings) -> dict[str, object]:
    return (link.keys.settings() if link.keys else {}) | {
        "scouting/multicast/enabled": False,
        "transport/link/tx/lease": int(LEASE * 1000),
        "transport/link/rx/max_message_size": 2 * MAX_PAYLOAD,
        # It would leave files in /dev/shm after a kill.
        "transport/shared_memory/enabled": False,
    }


def _config(
    settings: Mapping[str, object], endpoints: Sequence[str], link: LinkSettings
) -> zenoh.Config:
    config = link.base()
    if not endpoints or not all(_is_endpoint(endpoint) for endpoint in endpoints):
        raise EndpointError(tuple(endpoints))
    if link.keys and not all(endpoint.startswith("tls/") for endpoint in endpoints):
        raise NotEncryptedError(tuple(endpoints))
    try:
        for path, value in settings.items():
            config.insert_json5(path, json.dumps(value))
    except zenoh.ZError as error:
        raise EndpointError(tuple(endpoints)) from error
    return config


def _is_endpoint(text: str) -> bool:
    match = _ENDPOINT.fullmatch(text) if isinstance(text, str) else None
    return match is not None and int(match[2]) <= MAX_PORT


@contextmanager
def open_session(
    endpoints: Sequence[str] | None = None,
    *,
    mode: Mode = "client",
    patience: float | None = None,
    on_wait: Callable[[str], None] = lambda _: None,
    link: LinkSettings | None = None,
) -> Iterator[zenoh.Session]:
    """Open a session, close it in the end whatever happens.

    Parameters
    ----------
    endpoints
        Of the router, `default_endpoints` unless told; with several, the first that answers. One
        may be given as it is.
    patience
        How long to try [s]; None for as long as it takes.
    on_wait
        Called with the reason when the first attempt failed, and whenever the reason is another.
    link
        Keys and settings; those that the environment names unless given.

    Raises
    ------
    EndpointError
        If an endpoint is not one, or there is none.
    UnreachableError
        If nobody answered for `patience`.
    """
    if isinstance(endpoints, str):  # a sequence, too: of letters
        endpoints = [endpoints]
    link = LinkSettings.of_environment() if link is None else link
    encrypted = link.keys is not None
    addresses = default_endpoints(encrypted=encrypted) if endpoints is None else tuple(endpoints)
    with (
        _connect(addresses, mode, link, patience, on_wait) as session,
        mending_deaf_links(session),
    ):
        yield session


def _connect(
    endpoints: tuple[str, ...],
    mode: Mode,
    link: LinkSettings,
    patience: float | None,
    on_wait: Callable[[str], None],
) -> zenoh.Session:
    """Try until somebody answers, in short attempts: Ctrl-C does not break into one."""
    started = time.monotonic()
    told = ""
    while True:
        try:
            return zenoh.open(session_config(endpoints, mode, link))
        except zenoh.ZError as error:
            reason = reason_of(endpoints, link.keys)
            if patience is not None and time.monotonic() - started >= patience:
                raise UnreachableError(endpoints, patience, reason) from error
        if reason != told:
            told = reason
            on_wait(reason)
        time.sleep(PAUSE)


def declare_map_publisher(session: zenoh.Session, key: str) -> ze.AdvancedPublisher:
    """Return a publisher of robot maps, whose cache always holds a complete one."""
    return _declare_publisher(session, key, MESSAGES_TO_COMPLETE)


def declare_alignment_publisher(session: zenoh.Session, key: str) -> ze.AdvancedPublisher:
    """Return a publisher of alignments, of which the last one counts."""
    return _declare_publisher(session, key, 2)


def declare_marks_publisher(session: zenoh.Session, key: str) -> ze.AdvancedPublisher:
    """Return a publisher of a robot's marks: those of its last runs."""
    return _declare_publisher(session, key, 16)


def declare_joint_publisher(session: zenoh.Session, key: str) -> ze.AdvancedPublisher:
    """Return a publisher of joint maps; older versions than it caches come from the store."""
    return _declare_publisher(session, key, 16)


def declare_status_publisher(session: zenoh.Session, key: str) -> zenoh.Publisher:
    """Return a publisher of statuses: the next one says all that a lost one said."""
    return session.declare_publisher(key, congestion_control=zenoh.CongestionControl.DROP)


def declare_pose_publisher(session: zenoh.Session, key: str) -> zenoh.Publisher:
    """Return a publisher of poses: sent at once, and before maps."""
    return session.declare_publisher(
        key,
        congestion_control=zenoh.CongestionControl.DROP,
        priority=zenoh.Priority.INTERACTIVE_HIGH,
        express=True,
    )


def _declare_publisher(session: zenoh.Session, key: str, cached: int) -> ze.AdvancedPublisher:
    return ze.declare_advanced_publisher(
        session,
        key,
        cache=ze.CacheConfig(max_samples=cached),
        sample_miss_detection=ze.MissDetectionConfig(heartbeat=None, sporadic_heartbeat=HEARTBEAT),
        publisher_detection=True,
        congestion_control=zenoh.CongestionControl.DROP,
    )


def declare_subscriber(
    session: zenoh.Session, key: str, on_sample: OnSample, *, history: int = 1
) -> ze.AdvancedSubscriber[None]:
    """Return a subscriber that also gets the last `history` samples, and what was lost.

    Parameters
    ----------
    key
        A key expression.
    on_sample
        Called in a thread of Zenoh's; it must return at once.
    history
        How many of the samples published before, for each key.
    """
    return ze.declare_advanced_subscriber(
        session,
        key,
        on_sample,
        history=ze.HistoryConfig(max_samples=history, detect_late_publishers=True),
        recovery=ze.RecoveryConfig(periodic_queries=None, heartbeat=True),
    )
