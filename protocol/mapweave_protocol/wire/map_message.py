"""A robot's map as a message."""

from collections.abc import Iterable, Mapping, Sequence, Set
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import ClassVar, Self, TypeVar, cast

import numpy as np
from pydantic import Field, model_validator

from mapweave.geometry.arrays import FloatArray
from mapweave.kernels.range_coder import Coder, Encoder
from mapweave.maps import RobotMap, Submap
from mapweave_protocol.errors import MessageError
from mapweave_protocol.wire import packing
from mapweave_protocol.wire.budget import MIB, Budget
from mapweave_protocol.wire.coding import entropy
from mapweave_protocol.wire.geometry import (
    DIGEST_SIZE,
    MAX_BYTES,
    MAX_SUBMAPS,
    PackedSubmap,
    SubmapStream,
    decode_submaps,
    digest_of,
)
from mapweave_protocol.wire.model import WORLD_REACH, Count, Id, Message

MAX_COMPONENT = 99_999

T = TypeVar("T")
U = TypeVar("U")


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

    def encode(self, stream: SubmapStream) -> bytes:
        """Return the bytes of it.

        Raises
        ------
        ValueError
            If there is too much of anything.
        """
        encoder = stream.encoder(self.submaps)
        self.code_places(encoder)
        return encoder.finish()

    def code_places(self, encoder: Encoder) -> None:
        """Code all but the submaps, after these."""
        _code_gone(encoder, self.gone)
        _code_places(encoder, self.places)

    @classmethod
    def decode(cls, data: bytes) -> Self:
        """Return what `encode` gave `data` for.

        Raises
        ------
        ValueError
            If there is too much of anything.
        """
        decoder = entropy.decoder(data)
        submaps = tuple(decode_submaps(decoder))
        return cls(_code_gone(decoder, ()), _code_places(decoder, ()), submaps)


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
    budget: ClassVar[Budget] = Budget(16 * MIB, 32 * MIB, 50_000)

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
        return cls.whole(robot_map, packed, SubmapStream())

    @classmethod
    def whole(
        cls, robot_map: RobotMap, packed: Sequence[PackedSubmap], stream: SubmapStream
    ) -> Self:
        """Return the complete message of `robot_map`; parameters and errors as of `of_packed`."""
        everything = {submap.id for submap in packed}
        return cls.of_packed(robot_map, packed, everything, stream=stream)

    @classmethod
    def of_packed(
        cls,
        robot_map: RobotMap,
        packed: Sequence[PackedSubmap],
        include: Set[int],
        held: Mapping[int, Place] | None = None,
        stream: SubmapStream | None = None,
    ) -> Self:
        """Return the message of `robot_map` with the geometry of the submaps `include`.

        Parameters
        ----------
        packed
            The geometry of all submaps of `robot_map`, in their order.
        held
            Where receivers have them; None makes it complete.
        stream
            Codes what it coded the last time no more; None codes all.

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
        message = cls.model_construct(
            robot=robot_map.robot,
            boot=robot_map.boot,
            version=robot_map.version,
            complete=held is None,
            state=state_of(zip(places, (submap.digest for submap in packed), strict=True)),
            stream=_encoded(changes, stream or SubmapStream()),
        )
        # What was packed here is in order, and need not be decoded to see it.
        message.__dict__["changes"] = changes
        return cast("Self", message)

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
        return Changes.decode(self.stream)


def state_of(submaps: Iterable[tuple[Place, bytes]]) -> bytes:
    """Return the digest of a map: of where its submaps lie and of the geometry of each."""
    rows = [
        (*place.numbers, int.from_bytes(digest[:4], "little"), int.from_bytes(digest[4:], "little"))
        for place, digest in submaps
    ]
    return digest_of([np.array(rows, dtype=np.int64).reshape(-1, 7)])


def _encoded(changes: Changes, stream: SubmapStream) -> bytes:
    try:
        data = changes.encode(stream)
    except ValueError as error:
        raise MessageError(MapMessage.format, str(error)) from error
    if len(data) > MAX_BYTES:
        raise MessageError(MapMessage.format, f"{len(data)} bytes, expected at most {MAX_BYTES}")
    return data


def _code_gone(coder: Coder, given: Sequence[int]) -> tuple[int, ...]:
    """Code ids."""
    count = coder.count("gone", MAX_SUBMAPS, len(given))
    return tuple(coder.count("gone id", MAX_SUBMAPS - 1, n) for n in _padded(given, count, 0))


def _code_places(coder: Coder, given: Sequence[Place]) -> tuple[Place, ...]:
    """Code where submaps lie, each from the one before."""
    count = coder.count("places", MAX_SUBMAPS, len(given))
    last = Place(-1, 0, 0, 0, 0)
    places = []
    for place in _padded(given, count, None):
        last = _code_place(coder, place or last, last)
        places.append(last)
    return tuple(places)


def _code_place(coder: Coder, place: Place, last: Place) -> Place:
    submap = last.id + 1 + coder.count("place", MAX_SUBMAPS, max(place.id - last.id - 1, 0))
    component = last.component + coder.signed("component", place.component - last.component)
    if not (0 <= component <= MAX_COMPONENT and submap < MAX_SUBMAPS):
        raise ValueError(f"component {component} of submap {submap}, expected others")
    x = last.x + coder.signed("x", place.x - last.x)
    y = last.y + coder.signed("y", place.y - last.y)
    heading = last.heading + coder.signed("turn of place", place.heading - last.heading)
    return Place(submap, component, x, y, heading)


def _padded(given: Sequence[T], count: int, filling: U) -> Iterable[T | U]:
    """Return `given`, or from a decoder so many fillings."""
    return given or (filling for _ in range(count))
