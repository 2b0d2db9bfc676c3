"""What arrives, from several subscriptions in one order, read and checked."""

import threading
import time
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Generic, TypeVar

import zenoh

from mapweave.errors import MapweaveError
from mapweave_protocol.errors import MessageError
from mapweave_protocol.link.guard.refusals import Refusals
from mapweave_protocol.link.guard.turns import Turns
from mapweave_protocol.wire.codec import MAX_PAYLOAD, decode
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
    sender_of,
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
ROOM = 32 * 2**20  # [bytes]

M = TypeVar("M", bound=Message)
TOKEN = "token"


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

    @property
    def size(self) -> int:
        """How many bytes it takes."""
        return len(self.key) + len(self.payload)


class Inbox:
    """A queue between Zenoh's threads and ours, in which no sender delays another.

    Each sender has a queue of its own; next is who has taken least time so far, counted from one
    `get` to the next. When it is full, the oldest of the sender that has most in it is dropped.

    Parameters
    ----------
    capacity
        How many arrivals it holds.
    room
        How many bytes; one arrival always fits.
    clock
        Returns the time [s].
    """

    def __init__(
        self,
        capacity: int = CAPACITY,
        room: int = ROOM,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._capacity = capacity
        self._room = room
        self._clock = clock
        self._queues: dict[str, deque[Arrival]] = {}
        self._turns = Turns()
        self._served: tuple[str, float] | None = None  # whom, and when
        self._count = self._bytes = 0
        self._changed = threading.Condition()
        self._is_woken = False
        self.dropped = 0

    def put(self, sample: zenoh.Sample) -> None:
        """Take in `sample`; made to be a subscriber's callback."""
        gone = sample.kind == zenoh.SampleKind.DELETE
        too_large = len(sample.payload) > MAX_PAYLOAD
        # Empty, it is refused as what it is not; its bytes are nobody's to keep.
        payload = b"" if too_large else sample.payload.to_bytes()
        self.add(Arrival(str(sample.key_expr), payload, gone))

    def add(self, arrival: Arrival) -> None:
        """Take in `arrival`, in any thread."""
        with self._changed:
            sender = sender_of(arrival.key)
            if sender not in self._queues:
                self._queues[sender] = deque()
                self._turns.joins(sender)
            self._queues[sender].append(arrival)
            self._count += 1
            self._bytes += arrival.size
            while self._count > 1 and (self._count > self._capacity or self._bytes > self._room):
                self._drop()
            self._changed.notify()

    def wake(self) -> None:
        """Let who waits for an arrival, or will do so next, go on without one; in any thread."""
        with self._changed:
            self._is_woken = True
            self._changed.notify()

    def get(self, timeout: float) -> Arrival | None:
        """Return the next arrival, None if there is none within `timeout` [s], or it is woken."""
        with self._changed:
            if self._served is not None:
                sender, since = self._served
                self._turns.took(sender, self._clock() - since)
                self._served = None
            self._changed.wait_for(lambda: self._queues or self._is_woken, timeout)
            self._is_woken = False
            if not self._queues:
                return None
            sender = self._turns.next_of(self._queues)
            self._served = sender, self._clock()
            return self._take(sender, self._queues[sender])

    def newest(self, timeout: float) -> Arrival | None:
        """As `get`, of several arrivals at the key that is next the last one only."""
        arrival = self.get(timeout)
        if arrival is None:
            return None
        with self._changed:
            queue = self._queues.get(sender_of(arrival.key), deque())
            same = [one for one in queue if one.key == arrival.key]
            for one in same:
                queue.remove(one)
                self._forget(one)
            if not queue:
                self._queues.pop(sender_of(arrival.key), None)
        return same[-1] if same else arrival

    def _drop(self) -> None:
        by_bytes = self._bytes > self._room
        sender, queue = max(
            self._queues.items(),
            key=lambda item: sum(a.size for a in item[1]) if by_bytes else len(item[1]),
        )
        self._take(sender, queue)
        self.dropped += 1

    def _take(self, sender: str, queue: "deque[Arrival]") -> Arrival:
        arrival = queue.popleft()
        self._forget(arrival)
        if not queue:
            del self._queues[sender]
        return arrival

    def _forget(self, arrival: Arrival) -> None:
        self._count -= 1
        self._bytes -= arrival.size


class Reader(Generic[M]):
    """Reads the messages of one kind; refuses what is not valid, or from another than it says.

    Parameters
    ----------
    kind
        Of message.
    keys
        Where they come.
    refusals
        Where those are counted that are refused; of its own unless told.
    """

    def __init__(self, kind: type[M], keys: KeyFormat, refusals: Refusals | None = None) -> None:
        self._kind = kind
        self._keys = keys
        self._refusals = refusals or Refusals()

    @property
    def refused(self) -> int:
        """How many arrivals were refused, by all who count there."""
        return self._refusals.total

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
            self.refuse(arrival.key, error)
            return None
        return message

    def refuse(self, key: str, why: object) -> None:
        """Count a message under `key` as refused, for whatever reason."""
        self._refusals.add(sender_of(key), self._kind.format, key, why)


@dataclass(frozen=True, slots=True)
class Presence:
    """That a run of a robot is here, or no longer."""

    robot: str
    boot: str
    here: bool


def read_presence(arrival: Arrival, refusals: Refusals | None = None) -> Presence | None:
    """Return what a liveliness token says, None if `arrival` is none of a robot's."""
    if not LIVE.matches(arrival.key):
        return None
    try:
        parts = LIVE.parse(arrival.key)
    except MapweaveError as error:
        (refusals or Refusals()).add(sender_of(arrival.key), TOKEN, arrival.key, error)
        return None
    return Presence(parts["robot"], parts["boot"], here=not arrival.gone)


def read_coordinator(arrival: Arrival, refusals: Refusals | None = None) -> tuple[str, bool] | None:
    """Return the boot of a coordinator and whether it is here, None if `arrival` is no token."""
    if not COORDINATOR_LIVE.matches(arrival.key):
        return None
    try:
        boot = COORDINATOR_LIVE.parse(arrival.key)["boot"]
    except MapweaveError as error:
        (refusals or Refusals()).add(sender_of(arrival.key), TOKEN, arrival.key, error)
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
        If the id of a robot or an operator differs, what kind of order it is, or if somebody
        speaks of two others.
    """
    said = message.model_dump(include={"robot"})
    if isinstance(message, OrderMessage):
        said = {"name": message.by, "order": str(message.kind)}
    if isinstance(message, AlignmentMessage):
        pair = {"reference": message.reference.robot, "other": message.other.robot}
        if message.robot not in pair.values():
            raise MessageError(message.format, f"of two others, by {message.robot!r}")
        said |= pair
    for name, robot in said.items():
        if parts.get(name) != robot:
            raise MessageError(
                message.format, f"{name} {robot!r} under the key of {parts.get(name)!r}"
            )


def map_reader(refusals: Refusals | None = None) -> Reader[MapMessage]:
    """Return a reader of robot maps."""
    return Reader(MapMessage, MAP, refusals)


def marks_reader(refusals: Refusals | None = None) -> Reader[MarksMessage]:
    """Return a reader of the marks of robots."""
    return Reader(MarksMessage, MARK, refusals)


def order_reader(refusals: Refusals | None = None) -> Reader[OrderMessage]:
    """Return a reader of operators' orders."""
    return Reader(OrderMessage, ORDER, refusals)


def held_orders_reader(refusals: Refusals | None = None) -> Reader[OrdersMessage]:
    """Return a reader of what agents answer that were asked for all orders they hold."""
    return Reader(OrdersMessage, AGENT_QUERY, refusals)


def coordinators_orders_reader(refusals: Refusals | None = None) -> Reader[OrdersMessage]:
    """Return a reader of what the coordinator answers that was asked for them."""
    return Reader(OrdersMessage, JOINT_QUERY, refusals)


def pose_reader(refusals: Refusals | None = None) -> Reader[PoseMessage]:
    """Return a reader of poses."""
    return Reader(PoseMessage, POSE, refusals)


def status_reader(refusals: Refusals | None = None) -> Reader[StatusMessage]:
    """Return a reader of statuses."""
    return Reader(StatusMessage, STATUS, refusals)


def alignment_reader(refusals: Refusals | None = None) -> Reader[AlignmentMessage]:
    """Return a reader of alignments."""
    return Reader(AlignmentMessage, ALIGNMENT, refusals)


def joint_reader(refusals: Refusals | None = None) -> Reader[JointMapMessage]:
    """Return a reader of joint maps."""
    return Reader(JointMapMessage, JOINT_MAP, refusals)


def joint_status_reader(refusals: Refusals | None = None) -> Reader[JointStatusMessage]:
    """Return a reader of the coordinator's statuses."""
    return Reader(JointStatusMessage, JOINT_STATUS, refusals)
