"""A robot's runs on disk: what a restarted agent numbers on from, and delivers.

Of each run a file holds the whole map, as the message that travels, and another one what was found
of it and other runs: a list of such messages. Beside it lie the marks that the run made, and the
orders of operators that were heard of.
"""

import logging
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeVar

import msgpack

from mapweave.atomic import replace_file
from mapweave.errors import FileError
from mapweave.maps import RobotMap
from mapweave_protocol.errors import MessageError
from mapweave_protocol.link.assembler import MapAssembler, MapSender
from mapweave_protocol.wire.codec import decode, encode
from mapweave_protocol.wire.messages import (
    AlignmentMessage,
    MapMessage,
    MapVersion,
    MarksMessage,
    OrderMessage,
    OrdersMessage,
)
from mapweave_protocol.wire.model import Message

SUFFIX = ".map"
FOUND_SUFFIX = ".found"
MARKS_SUFFIX = ".marks"
ORDERS_FILE = "orders"

M = TypeVar("M", bound=Message)

_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, eq=False)
class PastRun:
    """A run that is over.

    Attributes
    ----------
    map
        What it mapped.
    payload
        The same, as its message.
    age
        How long ago it was written [s].
    found
        What it found of pairs of runs.
    marks
        The message of the marks that it made; None where it made none.
    """

    map: RobotMap
    payload: bytes
    age: float
    found: tuple[AlignmentMessage, ...] = ()
    marks: MarksMessage | None = None

    @property
    def state(self) -> MapVersion:
        """Which state of the map it is."""
        return MapVersion.of(self.map)

    @property
    def marks_state(self) -> MapVersion | None:
        """Which version of its marks they are; None where it made none."""
        if self.marks is None:
            return None
        robot, boot, version = self.marks.robot, self.marks.boot, self.marks.version
        return MapVersion(robot=robot, boot=boot, version=version)


class StateFolder:
    """The folder of a robot's runs; made where it is missing.

    Raises
    ------
    FileError
        If it cannot be made.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._sender = MapSender()
        try:
            path.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise FileError(path, f"cannot be made a folder ({error.strerror})") from error

    def keep(self, robot_map: RobotMap) -> None:
        """Keep the map of a run in place of the last one of that run.

        Raises
        ------
        FileError
            If it cannot be written.
        """
        payload = self._sender.payload(robot_map, complete=True)
        self._write(f"{robot_map.boot}{SUFFIX}", payload)

    def keep_marks(self, message: MarksMessage) -> None:
        """Keep the marks of a run in place of those kept before.

        Raises
        ------
        FileError
            If they cannot be written.
        """
        self._write(f"{message.boot}{MARKS_SUFFIX}", encode(message))

    def keep_orders(self, message: OrdersMessage) -> None:
        """Keep the orders of operators, all there are.

        Raises
        ------
        FileError
            If they cannot be written.
        """
        self._write(ORDERS_FILE, encode(message))

    def orders(self) -> tuple[OrderMessage, ...]:
        """Return the orders that are kept."""
        message = self._message(self.path / ORDERS_FILE, OrdersMessage)
        return () if message is None else message.orders

    def _write(self, name: str, payload: bytes) -> None:
        with replace_file(self.path / name) as new:
            new.write_bytes(payload)

    def keep_found(self, boot: str, found: Iterable[AlignmentMessage]) -> None:
        """Keep what a run has found in place of what it had found before.

        Raises
        ------
        FileError
            If it cannot be written.
        """
        with replace_file(self.path / f"{boot}{FOUND_SUFFIX}") as new:
            new.write_bytes(msgpack.packb([encode(message) for message in found]))

    def _message(self, path: Path, kind: type[M]) -> M | None:
        """Return what is in a file, None if it is not there; what is no message is told."""
        if not path.exists():
            return None
        try:
            return decode(kind, path.read_bytes())
        except MessageError as error:
            _log.warning("%s: passed over, %s", path, error)
            return None

    def runs(self, robot: str, now: float) -> list[PastRun]:
        """Return the runs of `robot`, the earliest first; `now` [s since 1970].

        A file that is none is told and left where it is: it must not keep a robot from its work.
        """
        found = [self._read(path, robot, now) for path in sorted(self.path.glob(f"[!.]*{SUFFIX}"))]
        runs = [run for run in found if run is not None and run.map.submaps]
        return sorted(runs, key=lambda run: max(run.map.components))

    def _read(self, path: Path, robot: str, now: float) -> PastRun | None:
        message = self._message(path, MapMessage)
        if message is None:
            return None
        robot_map = MapAssembler().update(message)
        if robot_map is None or robot_map.robot != robot:
            _log.warning("%s: passed over, no whole map of %s", path, robot)
            return None
        marks = self._message(path.with_suffix(MARKS_SUFFIX), MarksMessage)
        found = self._read_found(path.with_suffix(FOUND_SUFFIX))
        age = now - path.stat().st_mtime
        return PastRun(robot_map, path.read_bytes(), age, found, marks)

    def _read_found(self, path: Path) -> tuple[AlignmentMessage, ...]:
        """Return what a run has found; nothing where it found nothing, or the file is damaged."""
        if not path.exists():
            return ()
        try:
            payloads = msgpack.unpackb(path.read_bytes())
            return tuple(decode(AlignmentMessage, bytes(payload)) for payload in payloads)
        except (MessageError, TypeError, ValueError) as error:
            _log.warning("%s: passed over, %s", path, error)
            return ()


def default_folder(team: str, robot: str, environment: Mapping[str, str] = os.environ) -> Path:
    """Return where the runs of a robot are kept unless it is told."""
    home = environment.get("XDG_STATE_HOME") or str(Path.home() / ".local" / "state")
    return Path(home) / "mapweave" / team / robot


def first_component(maps: Iterable[RobotMap]) -> int:
    """Return the first number above the components of all `maps`."""
    return max((max(m.components, default=-1) for m in maps), default=-1) + 1


def numbered_from(robot_map: RobotMap, first: int) -> RobotMap:
    """Return `robot_map` with its components counted from `first` instead of 0."""
    submaps = (replace(s, component=first + s.component) for s in robot_map.submaps)
    return replace(robot_map, submaps=tuple(submaps)) if first else robot_map


def young_enough(runs: Sequence[PastRun], within: float) -> list[PastRun]:
    """Return the runs that ended less than `within` [s] ago; tell of the others."""
    old = [run for run in runs if run.age >= within]
    if old:
        _log.info("earlier runs kept, but not sent, as they are too old: %d", len(old))
    return [run for run in runs if run.age < within]
