"""A robot's map as a message."""

from collections.abc import Iterable, Mapping, Sequence, Set
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import ClassVar, Self, TypeVar

import numpy as np
from pydantic import Field, model_validator

from mapweave.geometry.arrays import FloatArray
from mapweave.maps import RobotMap, Submap
from mapweave_protocol.errors import MessageError
from mapweave_protocol.wire import packing
from mapweave_protocol.wire.coding.entropy import Coder, Decoder, Encoder
from mapweave_protocol.wire.coding.trajectory_code import Clock
from mapweave_protocol.wire.geometry import (
    DIGEST_SIZE,
    MAX_BYTES,
    MAX_SUBMAPS,
    PackedSubmap,
    digest_of,
)
from mapweave_protocol.wire.model import WORLD_REACH, Count, Id, Message

MAX_COMPONENT = 99_999

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Place:
    """Where a submap lies: x, y [mm] and heading [1e-5 rad] in the component's frame."""

    id: int
    component: int
    x: int
    y: int
    heading: int

    @classmethod
    def of(cls, submap: Submap) -> Self:
        """Return where `submap` lies.

        Raises
        ------
        ValueError
            If that is not finite, or too far out.
        """
        x, y, heading = packing.quantise_poses(submap.pose, WORLD_REACH)[0].tolist()
        return cls(submap.id, submap.component, x, y, heading)

    @property
    def pose(self) -> FloatArray:
        """(3,) [m, m, rad].

        Raises
        ------
        ValueError
            If it is out of bounds.
        """
        whole = packing.whole_numbers([[self.x, self.y, self.heading]])
        return np.asarray(packing.unquantise_poses(whole, WORLD_REACH)[0])

    @property
    def numbers(self) -> tuple[int, ...]:
        """All of it."""
        return self.id, self.component, self.x, self.y, self.heading


@dataclass(frozen=True, slots=True)
class Changes:
    """What a message says of a map.

    Attributes
    ----------
    gone
        Ids of submaps that are no longer part of it.
    places
        Where those submaps lie that are new or have moved, ids ascending.
    submaps
        The geometry of those that are new or have changed.
    """

    gone: tuple[int, ...]
    places: tuple[Place, ...]
    submaps: tuple[PackedSubmap, ...]

    @classmethod
    def code(cls, coder: Coder, changes: "Changes | None") -> Self:
        """Code `changes` with an encoder, or return what a decoder finds.

        Raises
        ------
        ValueError
            If there is too much of anything.
        """
        given = changes or cls((), (), ())
        gone = coder.count("gone", MAX_SUBMAPS, len(given.gone))
        left = [coder.count("gone id", MAX_SUBMAPS - 1, n) for n in _padded(given.gone, gone, 0)]
        count = coder.count("places", MAX_SUBMAPS, len(given.places))
        places = _code_places(coder, _padded(given.places, count, None))
        count = coder.count("submaps", MAX_SUBMAPS, len(given.submaps))
        clock = Clock()
        submaps = [
            PackedSubmap.code(coder, packed, clock)
            for packed in _padded(given.submaps, count, None)
        ]
        return cls(tuple(left), tuple(places), tuple(submaps))


class MapMessage(Message):
    """A robot map, or what changed in it.

    Attributes
    ----------
    complete
        Whether it is the whole map, whatever was there before.
    state
        Digest of the whole map: who has missed something sees that what it holds is not meant.
    stream
        The `Changes`.
    """

    letter: ClassVar[bytes] = b"m"
    format: ClassVar[str] = "map"

    robot: Id
    boot: Id
    version: Count
    complete: bool
    state: bytes = Field(min_length=DIGEST_SIZE, max_length=DIGEST_SIZE)
    stream: bytes = Field(max_length=MAX_BYTES)

    @classmethod
    def pack(cls, robot_map: RobotMap) -> Self:
        """Return the complete message of `robot_map`."""
        packed = [PackedSubmap.pack(submap) for submap in robot_map.submaps]
        return cls.of_packed(robot_map, packed, {submap.id for submap in packed})

    @classmethod
    def of_packed(
        cls,
        robot_map: RobotMap,
        packed: Sequence[PackedSubmap],
        include: Set[int],
        held: Mapping[int, Place] | None = None,
    ) -> Self:
        """Return the message of `robot_map` with the geometry of the submaps `include`.

        Parameters
        ----------
        packed
            The geometry of all submaps of `robot_map`, in their order.
        held
            Where receivers have them; None makes it complete.

        Raises
        ------
        MessageError
            If there is too much of anything.
        """
        before = held or {}
        places = [Place.of(submap) for submap in robot_map.submaps]
        gone = before.keys() - {place.id for place in places}
        moved = tuple(place for place in places if before.get(place.id) != place)
        geometry = tuple(submap for submap in packed if submap.id in include)
        changes = Changes(tuple(sorted(gone)), moved, geometry)
        return cls(
            robot=robot_map.robot,
            boot=robot_map.boot,
            version=robot_map.version,
            complete=held is None,
            state=state_of(zip(places, (submap.digest for submap in packed), strict=True)),
            stream=_encoded(changes),
        )

    @model_validator(mode="after")
    def _check(self) -> Self:
        places = [place.id for place in self.changes.places]
        submaps = [submap.id for submap in self.changes.submaps]
        for ids in (places, submaps):
            if any(later <= earlier for earlier, later in pairwise(ids)):
                raise ValueError("submaps, expected each once, ids ascending")
        if self.complete and (places != submaps or self.changes.gone):
            raise ValueError("said to be complete, but submaps are missing")
        # What is out of bounds is refused now, not where it is used.
        for place in self.changes.places:
            place.pose  # noqa: B018
        for submap in self.changes.submaps:
            submap.restored  # noqa: B018
        return self

    @cached_property
    def changes(self) -> Changes:
        """What it says.

        Raises
        ------
        ValueError
            If the stream is damaged.
        """
        return Changes.code(Decoder(self.stream), None)


def state_of(submaps: Iterable[tuple[Place, bytes]]) -> bytes:
    """Return the digest of a map: of where its submaps lie and of the geometry of each."""
    rows = [
        (*place.numbers, int.from_bytes(digest[:4], "little"), int.from_bytes(digest[4:], "little"))
        for place, digest in submaps
    ]
    return digest_of([np.array(rows, dtype=np.int64).reshape(-1, 7)])


def _encoded(changes: Changes) -> bytes:
    encoder = Encoder()
    try:
        Changes.code(encoder, changes)
    except ValueError as error:
        raise MessageError(MapMessage.format, str(error)) from error
    return encoder.finish()


def _code_places(coder: Coder, given: Iterable[Place | None]) -> Iterable[Place]:
    """Code where submaps lie, each from the one before."""
    last = Place(-1, 0, 0, 0, 0)
    for place in given:
        to = place or last
        submap = (
            last.id + 1 + coder.count("place", MAX_SUBMAPS, to.id - last.id - 1 if place else 0)
        )
        component = last.component + coder.signed("component", to.component - last.component)
        if not (0 <= component <= MAX_COMPONENT and submap < MAX_SUBMAPS):
            raise ValueError(f"component {component} of submap {submap}, expected others")
        x = last.x + coder.signed("x", to.x - last.x)
        y = last.y + coder.signed("y", to.y - last.y)
        heading = last.heading + coder.signed("heading", to.heading - last.heading)
        last = Place(submap, component, x, y, heading)
        yield last


def _padded(given: Sequence[T], count: int, filling: T) -> Iterable[T]:
    """Return `given`, or from a decoder so many fillings."""
    return given or (filling for _ in range(count))
