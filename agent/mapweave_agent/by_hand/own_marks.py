"""The marks that a run of a robot makes; usable from several threads."""

import threading
from collections.abc import Iterable, Sequence
from typing import Literal, TypeAlias

import numpy as np

from mapweave.anchors import anchored
from mapweave.errors import ArgumentError
from mapweave.geometry.arguments import as_number
from mapweave.geometry.arrays import FloatArray
from mapweave.maps import Submap
from mapweave.marks import MAX_LABEL, Anchor, Mark
from mapweave_protocol.wire.messages import MapVersion, MarksMessage
from mapweave_protocol.wire.model import ORDER_REACH
from mapweave_protocol.wire.orders.marks_message import MAX_MARKS
from mapweave_protocol.wire.orders.order_message import new_order_id

Frame: TypeAlias = Literal["map", "sensor"]


class OwnMarks:
    """Makes marks on what a run has mapped.

    Parameters
    ----------
    robot, boot
        Of the run.
    before
        Marks of the stored map that the run began with.
    """

    def __init__(self, robot: str, boot: str, before: Iterable[Mark] = ()) -> None:
        self._robot = robot
        self._boot = boot
        self._lock = threading.Lock()
        self._marks = {mark.id: mark for mark in before}
        self._version = 1 if self._marks else 0
        self._published = 0

    def add(
        self, submaps: Sequence[Submap], label: str, place: FloatArray, frame: Frame, now: float
    ) -> str:
        """Mark a place; return the mark's id.

        Parameters
        ----------
        submaps
            What is mapped so far.
        place
            (2,) [m] in `frame`: of the component in which the robot is, or of its sensor at the
            last scan that is mapped.
        now
            [s since 1970]

        Raises
        ------
        ArgumentError
            If nothing is mapped yet, or there are too many marks already.
        """
        anchor, position = _held(submaps, place, frame)
        identity = new_order_id()
        with self._lock:
            if len(self._marks) >= MAX_MARKS:
                raise ArgumentError("mark", f"expected no more than {MAX_MARKS} in a run")
            self._marks[identity] = Mark(identity, label, self._robot, now, anchor, position)
            self._version += 1
        return identity

    def remove(self, identity: str) -> None:
        """Take back a mark.

        Raises
        ------
        ArgumentError
            If there is none of that id.
        """
        with self._lock:
            if self._marks.pop(identity, None) is None:
                raise ArgumentError("mark", f"no mark {identity!r} of this run")
            self._version += 1

    @property
    def all(self) -> tuple[Mark, ...]:
        """Those that were made and not taken back."""
        with self._lock:
            return tuple(self._marks.values())

    @property
    def state(self) -> MapVersion | None:
        """Which version was published last; None where nothing was ever marked."""
        if not self._published:
            return None
        return MapVersion(robot=self._robot, boot=self._boot, version=self._published)

    @property
    def is_news(self) -> bool:
        """Whether something was marked that is not published."""
        return self._version > self._published

    def message(self) -> MarksMessage:
        """Return what is to be published: all marks."""
        with self._lock:
            self._published = self._version
            marks = list(self._marks.values())
        return MarksMessage.pack(self._robot, self._boot, self._published, marks)


def _held(submaps: Sequence[Submap], place: FloatArray, frame: Frame) -> tuple[Anchor, FloatArray]:
    """Return what holds a mark at `place`, and where it is from there."""
    driven = [submap for submap in submaps if len(submap.trajectory.scan_index)]
    last = max(driven, key=lambda s: int(s.trajectory.scan_index[-1]), default=None)
    if last is None:
        raise ArgumentError("mark", "nothing is mapped yet; expected a scan that was placed")
    here = Anchor(last.id, int(last.trajectory.scan_index[-1])), place
    if frame == "sensor":
        return here
    return anchored(submaps, last.component, place) or here


def checked(label: str, x: float, y: float, frame: str) -> FloatArray:
    """Return the (2,) place [m] of a mark, its arguments checked.

    Raises
    ------
    ArgumentError
        If one cannot be used.
    """
    if not (isinstance(label, str) and label.isprintable() and 0 < len(label) <= MAX_LABEL):
        raise ArgumentError("label", f"expected 1 to {MAX_LABEL} printable characters")
    if frame not in ("map", "sensor"):
        raise ArgumentError("frame", f"expected 'map' or 'sensor', got {frame!r}")
    return np.array([_coordinate("x", x), _coordinate("y", y)])


def _coordinate(name: str, value: float) -> float:
    expected = f"expected a number of at most {ORDER_REACH:g} [m]"
    number = as_number(name, value, expected)
    if abs(number) > ORDER_REACH:
        raise ArgumentError(name, f"{expected}, got {value!r}")
    return number
