"""A node that ROS 2 sees: its topics are listed, and what is latched reaches who comes late.

`rmw_zenoh` tells nodes and their publishers from liveliness tokens (see `graph`), and gives late
subscriptions what the cache of an advanced publisher holds.
"""

import itertools
import secrets
import struct
import time
from collections.abc import Mapping
from contextlib import ExitStack
from types import TracebackType
from typing import Self

import zenoh
import zenoh.ext as ze

from mapweave_protocol.link.session import HEARTBEAT
from mapweave_ros.messages import Messages
from mapweave_ros.network import Ros2Network
from mapweave_ros.topics import TYPE_HASH_NOT_SUPPORTED, dds_type_of

LATCHED, PASSING = ":1:,1:,:,:,,", "::,10:,:,:,,"
"""Quality of service as tokens name it: transient local, the last one; volatile, the last ten."""


class Publisher:
    """Publishes the messages of one topic."""

    def __init__(self, publisher: ze.AdvancedPublisher | zenoh.Publisher) -> None:
        self._publisher = publisher
        self._gid = secrets.token_bytes(16)
        self._sequence = 0

    def put(self, payload: bytes) -> None:
        """Publish a message, with what `rmw_zenoh` attaches: number, time, and who says it."""
        self._sequence += 1
        head = struct.pack("<qqB", self._sequence, time.time_ns(), len(self._gid))
        self._publisher.put(payload, attachment=head + self._gid)


class Node:
    """A node; a context manager.

    Parameters
    ----------
    session
        On the network; it stays the caller's.
    network
        Its domain, and how it names types.
    name
        The node's, such as ``mapweave_r1``.
    topics
        The type of each topic that is published, and whether it is latched.
    """

    def __init__(
        self,
        session: zenoh.Session,
        network: Ros2Network,
        name: str,
        topics: Mapping[str, tuple[str, bool]],
    ) -> None:
        self._session = session
        self._network = network
        self._name = name
        self._topics = topics
        self._messages = Messages()
        self._declared = ExitStack()
        self._publishers: dict[str, Publisher] = {}

    def __enter__(self) -> Self:
        with ExitStack() as stack:
            numbers = itertools.count(1)
            alive = self._session.liveliness()
            who = f"@ros2_lv/{self._network.domain}/{self._session.info.zid()}/0"
            stack.enter_context(alive.declare_token(f"{who}/0/NN/%/%/{self._name}"))
            for topic, (kind, latched) in self._topics.items():
                publisher = self._declare(self._key(topic, kind), latched=latched)
                stack.enter_context(publisher)
                self._publishers[topic] = Publisher(publisher)
                mangled, quality = topic.replace("/", "%"), LATCHED if latched else PASSING
                named = f"{mangled}/{dds_type_of(kind)}/{self._hash(kind)}"
                token = f"{who}/{next(numbers)}/MP/%/%/{self._name}/{named}/{quality}"
                stack.enter_context(alive.declare_token(token))
            self._declared = stack.pop_all()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._declared.close()

    def put(self, topic: str, payload: bytes) -> None:
        """Publish a message at one of the topics."""
        self._publishers[topic].put(payload)

    def _key(self, topic: str, kind: str) -> str:
        where = f"{self._network.domain}/{topic.removeprefix('/')}"
        return f"{where}/{dds_type_of(kind)}/{self._hash(kind)}"

    def _hash(self, kind: str) -> str:
        return self._messages.type_hash(kind) if self._network.hashed else TYPE_HASH_NOT_SUPPORTED

    def _declare(self, key: str, *, latched: bool) -> ze.AdvancedPublisher | zenoh.Publisher:
        drop = zenoh.CongestionControl.DROP
        if not latched:
            return self._session.declare_publisher(key, congestion_control=drop)
        return ze.declare_advanced_publisher(
            self._session,
            key,
            cache=ze.CacheConfig(max_samples=1),
            sample_miss_detection=ze.MissDetectionConfig(
                heartbeat=None, sporadic_heartbeat=HEARTBEAT
            ),
            publisher_detection=True,
            congestion_control=drop,
        )
