"""What the coordinator hands over to those who look: immutable values, never waited for."""

import math
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace

from mapweave.maps import RobotMap
from mapweave_fusion_server.web.positions import Positions
from mapweave_protocol.wire.messages import JointMapMessage, OrderMessage, StatusMessage


@dataclass(frozen=True, slots=True)
class RobotReport:
    """What is known of a robot.

    Attributes
    ----------
    robot
        Its id.
    runs
        How many runs of it are alive: one, where nothing is wrong; none when it is gone.
    status
        What it said last of itself; of several runs, the one that was heard last.
    heard
        When it was heard last [s since 1970]; None if not since the coordinator began.
    map_version
        Which version of the map of that run is here; None if none is. Of the last run, where none
        was heard.
    """

    robot: str
    runs: int
    status: StatusMessage | None
    heard: float | None
    map_version: int | None


@dataclass(frozen=True, slots=True)
class CoordinatorReport:
    """How the coordinator is.

    Attributes
    ----------
    boot
        Of this start of it.
    started, stamp
        When it began, and when this was said [s since 1970].
    pending
        Whether something was received that is in no version yet.
    refused
        Messages that were not valid and dropped.
    refusals
        The same by who sent them and what they were.
    dropped
        Messages that found no room.
    storing
        Whether versions are stored; not while the disk is full.
    damaged
        Rows of the store that could not be read.
    """

    boot: str = ""
    started: float = 0.0
    stamp: float = 0.0
    pending: bool = False
    refused: int = 0
    refusals: Mapping[tuple[str, str], int] = field(default_factory=dict)
    dropped: int = 0
    storing: bool = True
    damaged: int = 0


@dataclass(frozen=True, slots=True)
class Seen:
    """All that was handed over last.

    Attributes
    ----------
    version
        The number of the latest version, 0 when there is none.
    maps
        The robots' maps that it was made of, one for each run.
    message
        What says it, complete; None where it is only in the store.
    """

    version: int = 0
    maps: tuple[RobotMap, ...] = ()
    message: JointMapMessage | None = None
    robots: tuple[RobotReport, ...] = ()
    coordinator: CoordinatorReport = field(default_factory=CoordinatorReport)


Listener = Callable[[Seen], object]
MAX_WAITING = 64  # orders


class Feed:
    """Keeps what was handed over last, and tells those who listen; usable from several threads.

    A listener is called in the thread of the coordinator, and must return at once. Orders go the
    other way: they wait until the coordinator takes them.

    Attributes
    ----------
    positions
        Where the robots are now: these come past the coordinator, at the rate of scans.
    """

    def __init__(self) -> None:
        self.positions = Positions()
        self._lock = threading.Lock()
        self._orders: deque[OrderMessage] = deque()
        self._seen = Seen()
        self._told = -math.inf
        self._listeners: tuple[Listener, ...] = ()

    @property
    def age(self) -> float:
        """How long ago the coordinator said how it is [s]; infinite before it did."""
        return time.monotonic() - self._told

    @property
    def seen(self) -> Seen:
        """What was handed over last."""
        return self._seen

    @contextmanager
    def heard_by(self, listener: Listener) -> Iterator[None]:
        """Call `listener` with all there is whenever something is handed over in the block."""
        with self._lock:
            self._listeners += (listener,)
        try:
            yield
        finally:
            with self._lock:
                self._listeners = tuple(one for one in self._listeners if one is not listener)

    def give_order(self, order: OrderMessage) -> bool:
        """Have the coordinator take `order`; return whether there is room for it to wait."""
        with self._lock:
            if len(self._orders) >= MAX_WAITING:
                return False
            self._orders.append(order)
            return True

    def orders(self) -> list[OrderMessage]:
        """Take the orders that wait."""
        with self._lock:
            waiting = list(self._orders)
            self._orders.clear()
        return waiting

    def show_version(
        self, version: int, maps: tuple[RobotMap, ...], message: JointMapMessage | None = None
    ) -> None:
        """Hand over that `version` is in the store, made of `maps`, and what says it."""
        with self._lock:
            self._seen = replace(self._seen, version=version, maps=maps, message=message)
        self._tell()

    def show_team(self, robots: tuple[RobotReport, ...], coordinator: CoordinatorReport) -> None:
        """Hand over how robots and coordinator are."""
        with self._lock:
            self._seen = replace(self._seen, robots=robots, coordinator=coordinator)
            self._told = time.monotonic()
        self._tell()

    def _tell(self) -> None:
        for listener in self._listeners:
            listener(self._seen)
