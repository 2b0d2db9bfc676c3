"""What arrives, from several subscriptions in one order, read and checked."""

import logging
import threading
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Generic, TypeVar

import zenoh

from mapweave.errors import MapweaveError
from mapweave_protocol.errors import MessageError
from mapweave_protocol.wire.codec import decode
from mapweave_protocol.wire.keys import (
    AGENT_QUERY,
    ALIGNMENT,
    COORDINATOR_LIVE,
    JOINT_MAP,
    JOINT_QUERY,
    JOINT_STATUS,
    LIVE,
    MAP,
    MARK,
    ORDER,
    POSE,
    STATUS,
    KeyFormat,
)
from mapweave_protocol.wire.messages import (
    AlignmentMessage,
    JointMapMessage,
    JointStatusMessage,
    MapMessage,
    MarksMessage,
    OrderMessage,
    OrdersMessage,
    PoseMessage,
    StatusMessage,
)
from mapweave_protocol.wire.model import Message

CAPACITY = 4096
MAX_WARNED = 256

M = TypeVar("M", bound=Message)
_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class Arrival:
    """A sample.

    Attributes
    ----------
    key
        Where it was published.
    payload
        What.
    gone
        It says that what was at the key is no longer, such as a robot's token.
    """

    key: str
    payload: bytes
    gone: bool = False


class Inbox:
    """A queue between Zenoh's threads and ours; when it is full, the oldest is dropped."""

    def __init__(self, capacity: int = CAPACITY) -> None:
        self._arrivals: deque[Arrival] = deque(maxlen=capacity)
        self._changed = threading.Condition()

    def put(self, sample: zenoh.Sample) -> None:
        """Take in `sample`; made to be a subscriber's callback."""
        gone = sample.kind == zenoh.SampleKind.DELETE
        self.add(Arrival(str(sample.key_expr), sample.payload.to_bytes(), gone))

    def add(self, arrival: Arrival) -> None:
        """Take in `arrival`, in any thread."""
        with self._changed:
            self._arrivals.append(arrival)
            self._changed.notify()

    def get(self, timeout: float) -> Arrival | None:
        """Return the next arrival, None if there is none within `timeout` [s]."""
        with self._changed:
            self._changed.wait_for(lambda: self._arrivals, timeout)
            return self._arrivals.popleft() if self._arrivals else None

    def newest(self, timeout: float) -> Arrival | None:
        """As `get`, of several arrivals at the key that is next the last one only."""
        with self._changed:
            self._changed.wait_for(lambda: self._arrivals, timeout)
            if not self._arrivals:
                return None
            key = self._arrivals[0].key
            same = [arrival for arrival in self._arrivals if arrival.key == key]
            others = [arrival for arrival in self._arrivals if arrival.key != key]
            self._arrivals.clear()
            self._arrivals.extend(others)
            return same[-1]


class Reader(Generic[M]):
    """Reads the messages of one kind; refuses what is not valid, or from another than it says.

    Attributes
    ----------
    refused
        How many arrivals were refused. Of each key the first one is logged.
    """

    def __init__(self, kind: type[M], keys: KeyFormat) -> None:
        self.refused = 0
        self._kind = kind
        self._keys = keys
        self._warned: set[str] = set()

    def reads(self, arrival: Arrival) -> bool:
        """Tell whether `arrival` came in at one of this reader's keys."""
        return self._keys.matches(arrival.key) and not arrival.gone

    def read(self, arrival: Arrival) -> M | None:
        """Return the message, None if it was refused."""
        try:
            parts = self._keys.parse(arrival.key)
            message = decode(self._kind, arrival.payload)
            check_origin(message, parts)
        except MapweaveError as error:
            self._refuse(arrival.key, error)
            return None
        return message

    def _refuse(self, key: str, error: MapweaveError) -> None:
        self.refused += 1
        if key not in self._warned and len(self._warned) < MAX_WARNED:
            self._warned.add(key)
            _log.warning("%s: ignored, %s", key, error)


@dataclass(frozen=True, slots=True)
class Presence:
    """That a run of a robot is here, or no longer."""

    robot: str
    boot: str
    here: bool


def read_presence(arrival: Arrival) -> Presence | None:
    """Return what a liveliness token says, None if `arrival` is none of a robot's."""
    if not LIVE.matches(arrival.key):
        return None
    try:
        parts = LIVE.parse(arrival.key)
    except MapweaveError as error:
        _log.warning("%s: ignored, %s", arrival.key, error)
        return None
    return Presence(parts["robot"], parts["boot"], here=not arrival.gone)


def read_coordinator(arrival: Arrival) -> tuple[str, bool] | None:
    """Return the boot of a coordinator and whether it is here, None if `arrival` is no token."""
    if not COORDINATOR_LIVE.matches(arrival.key):
        return None
    try:
        boot = COORDINATOR_LIVE.parse(arrival.key)["boot"]
    except MapweaveError as error:
        _log.warning("%s: ignored, %s", arrival.key, error)
        return None
    return boot, not arrival.gone


def check_origin(message: Message, parts: Mapping[str, str]) -> None:
    """Check that a message says of itself what its key says.

    Parameters
    ----------
    parts
        The parts of the key it came by.

    Raises
    ------
    MessageError
        If the id of a robot or an operator differs, or what kind of order it is.
    """
    said = message.model_dump(include={"robot"})
    if isinstance(message, OrderMessage):
        said = {"name": message.by, "order": str(message.kind)}
    if isinstance(message, AlignmentMessage):
        said |= {"reference": message.reference.robot, "other": message.other.robot}
    for name, robot in said.items():
        if parts.get(name) != robot:
            raise MessageError(
                message.format, f"{name} {robot!r} under the key of {parts.get(name)!r}"
            )


def map_reader() -> Reader[MapMessage]:
    """Return a reader of robot maps."""
    return Reader(MapMessage, MAP)


def marks_reader() -> Reader[MarksMessage]:
    """Return a reader of the marks of robots."""
    return Reader(MarksMessage, MARK)


def order_reader() -> Reader[OrderMessage]:
    """Return a reader of operators' orders."""
    return Reader(OrderMessage, ORDER)


def held_orders_reader() -> Reader[OrdersMessage]:
    """Return a reader of what agents answer that were asked for all orders they hold."""
    return Reader(OrdersMessage, AGENT_QUERY)


def coordinators_orders_reader() -> Reader[OrdersMessage]:
    """Return a reader of what the coordinator answers that was asked for them."""
    return Reader(OrdersMessage, JOINT_QUERY)


def pose_reader() -> Reader[PoseMessage]:
    """Return a reader of poses."""
    return Reader(PoseMessage, POSE)


def status_reader() -> Reader[StatusMessage]:
    """Return a reader of statuses."""
    return Reader(StatusMessage, STATUS)


def alignment_reader() -> Reader[AlignmentMessage]:
    """Return a reader of alignments."""
    return Reader(AlignmentMessage, ALIGNMENT)


def joint_reader() -> Reader[JointMapMessage]:
    """Return a reader of joint maps."""
    return Reader(JointMapMessage, JOINT_MAP)


def joint_status_reader() -> Reader[JointStatusMessage]:
    """Return a reader of the coordinator's statuses."""
    return Reader(JointStatusMessage, JOINT_STATUS)
