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

from mapweave_protocol.errors import EndpointError, UnreachableError
from mapweave_protocol.link.assembler import MESSAGES_TO_COMPLETE
from mapweave_protocol.wire.codec import MAX_PAYLOAD

DEFAULT_ENDPOINT = "tcp/localhost:7447"
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


def default_endpoints() -> tuple[str, ...]:
    """Return where the router is: from ``MAPWEAVE_CONNECT``, comma-separated, or this machine."""
    words = os.environ.get(ENDPOINT_VARIABLE, DEFAULT_ENDPOINT).split(",")
    return tuple(word.strip() for word in words if word.strip()) or (DEFAULT_ENDPOINT,)


def session_config(endpoints: Sequence[str], mode: Mode = "client") -> zenoh.Config:
    """Return the configuration of a session that connects to `endpoints`.

    Raises
    ------
    EndpointError
        If one is not an endpoint such as ``tcp/localhost:7447``.
    """
    settings = _common_settings() | {
        "mode": mode,
        "connect/endpoints": list(endpoints),
        "connect/timeout_ms": int(ATTEMPT * 1000),
        "connect/exit_on_failure": True,
        "connect/retry": RETRY,
    }
    return _config(settings, endpoints)


def router_config(listen: Sequence[str], connect: Sequence[str] = ()) -> zenoh.Config:
    """Return the configuration of a router that listens at the endpoints `listen`.

    Parameters
    ----------
    connect
        Where other routers listen: who is at any of them reaches who is at another.

    Raises
    ------
    EndpointError
        If one is not an endpoint such as ``tcp/0.0.0.0:7447``.
    """
    settings = _common_settings() | {
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
    return _config(settings, [*listen, *connect])


def _common_settings() -> dict[str, object]:
    return {
        "scouting/multicast/enabled": False,
        "transport/link/tx/lease": int(LEASE * 1000),
        "transport/link/rx/max_message_size": 2 * MAX_PAYLOAD,
        # It would leave files in /dev/shm after a kill.
        "transport/shared_memory/enabled": False,
    }


def _config(settings: Mapping[str, object], endpoints: Sequence[str]) -> zenoh.Config:
    config = zenoh.Config()
    if not endpoints or not all(_is_endpoint(endpoint) for endpoint in endpoints):
        raise EndpointError(tuple(endpoints))
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
    on_wait: Callable[[], None] = lambda: None,
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
        Called once when the first attempt failed.

    Raises
    ------
    EndpointError
        If an endpoint is not one, or there is none.
    UnreachableError
        If nobody answered for `patience`.
    """
    if isinstance(endpoints, str):  # a sequence, too: of letters
        endpoints = [endpoints]
    addresses = default_endpoints() if endpoints is None else tuple(endpoints)
    with _connect(addresses, mode, patience, on_wait) as session:
        yield session


def _connect(
    endpoints: tuple[str, ...],
    mode: Mode,
    patience: float | None,
    on_wait: Callable[[], None],
) -> zenoh.Session:
    """Try until somebody answers, in short attempts: Ctrl-C does not break into one."""
    started = time.monotonic()
    waiting = False
    while True:
        try:
            return zenoh.open(session_config(endpoints, mode))
        except zenoh.ZError as error:
            if patience is not None and time.monotonic() - started >= patience:
                raise UnreachableError(endpoints, patience) from error
        if not waiting:
            waiting = True
            on_wait()
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
