"""The parts of messages that hold geometry: submaps and line maps, as whole numbers."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from hashlib import blake2b
from typing import Self
from weakref import WeakValueDictionary

import numpy as np

from mapweave.geometry.arrays import FloatArray, IntArray
from mapweave.geometry.segments import lengths
from mapweave.kernels.range_coder import Coder, Encoder
from mapweave.maps import LineMap, Submap
from mapweave_protocol.wire.coding import entropy
from mapweave_protocol.wire.coding.changes import code_changed_free_space, code_changed_lines
from mapweave_protocol.wire.coding.free_space_code import CodedFreeSpace, code_free_space
from mapweave_protocol.wire.coding.line_code import CodedLines, code_lines, main_turn
from mapweave_protocol.wire.coding.trajectory_code import Clock, CodedTrajectory, code_trajectory
from mapweave_protocol.wire.packing import whole_numbers

SUBMAP_REACH = 1e3  # [m] from a submap's origin; submaps are some 20 m across
MAX_SUBMAPS = 4096  # of one robot: some 60 km of path
DIGEST_SIZE = 8  # [bytes]
MAX_BYTES = 8 * 2**20  # of one stream
STAGES = 3  # the submap that grows, the one that has just settled, and one more
ANOTHER = "submaps"  # the context of whether another one follows
MAX_WALL = 100_000.0  # [m] of one line map; comparing maps takes time and memory by the metre


@dataclass(frozen=True, slots=True, eq=False)
class PackedLines:
    """A line map: segments by polyline, their support, and the free space."""

    lines: CodedLines
    free: CodedFreeSpace

    @classmethod
    def pack(cls, lines: LineMap, reach: float, confidence: FloatArray | None = None) -> Self:
        """Return `lines` packed, ``(n,)`` `confidence` with them; too short ones vanish.

        Raises
        ------
        ValueError
            If a coordinate is not finite, or beyond `reach` [m].
        """
        turn = main_turn(lines)
        coded = CodedLines.of(lines, turn, reach, confidence)
        return cls(coded, CodedFreeSpace.of(lines.free_space, turn, reach))

    @classmethod
    def code(cls, coder: Coder, packed: "PackedLines | None", *, confident: bool = False) -> Self:
        """Code `packed` with an encoder, or return what a decoder finds.

        Raises
        ------
        ValueError
            If there is too much of anything.
        """
        lines = code_lines(coder, packed.lines if packed else None, confident=confident)
        return cls(lines, code_free_space(coder, packed.free if packed else None))

    @classmethod
    def code_changes(
        cls, coder: Coder, before: "PackedLines", after: "PackedLines | None"
    ) -> "PackedLines":
        """Code what makes `before` `after`, or return what a decoder finds.

        Raises
        ------
        ValueError
            If there is too much of anything.
        """
        lines = code_changed_lines(coder, before.lines, after.lines if after else None)
        free = code_changed_free_space(coder, before.free, after.free if after else None)
        return cls(lines, free)

    def unpack(self, reach: float) -> LineMap:
        """Return the line map.

        Raises
        ------
        ValueError
            If a coordinate is beyond `reach` [m], or there is more wall than any robot maps.
        """
        segments, polyline, support = self.check(reach)
        return LineMap(segments, polyline, support, self.free.restore(self.lines.turn, reach))

    def check(self, reach: float) -> tuple[FloatArray, IntArray, IntArray]:
        """Return segments, polylines and support as of `CodedLines.restore`.

        Raises
        ------
        ValueError
            If a coordinate is beyond `reach` [m], or there is more wall than any robot maps.
        """
        segments, polyline, support = self.lines.restore()
        # A frame that is turned lets what was at the limit come back a rounding beyond.
        if not np.all(np.abs(segments) <= 1.01 * reach):
            raise ValueError(f"expected numbers of at most {reach:g}")
        wall = float(lengths(segments).sum())
        if wall > MAX_WALL:
            raise ValueError(f"{wall:.0f} m of wall, expected at most {MAX_WALL:.0f} m")
        if np.any(np.all(segments[:, :2] == segments[:, 2:], axis=1)):
            raise ValueError("a segment without length")
        return segments, polyline, support

    @property
    def columns(self) -> list[IntArray]:
        """All the numbers, in a fixed order."""
        lines = self.lines
        sizes = [[len(area), *map(len, area)] for area in self.free.areas]
        return [
            np.array([lines.turn, len(lines.counts), len(lines.segments)]),
            *(lines.counts, lines.segments, lines.support),
            *([] if lines.confidence is None else [lines.confidence]),
            *(np.array(size) for size in sizes),
            *(ring for area in self.free.areas for ring in area),
        ]


@dataclass(frozen=True, eq=False)
class PackedSubmap:
    """A submap without its pose and component, which travel with every message."""

    id: int
    lines: PackedLines
    trajectory: CodedTrajectory

    @classmethod
    def pack(cls, submap: Submap) -> Self:
        """Return the geometry of `submap` packed.

        Raises
        ------
        ValueError
            If a coordinate is not finite, or too far from the submap's origin.
        """
        lines = PackedLines.pack(submap.map, SUBMAP_REACH)
        return cls(submap.id, lines, CodedTrajectory.of(submap.trajectory, SUBMAP_REACH))

    @classmethod
    def code(cls, coder: Coder, packed: "PackedSubmap | None", clock: Clock) -> Self:
        """Code `packed` with an encoder, or return what a decoder finds.

        Parameters
        ----------
        clock
            Where the submap before ended.

        Raises
        ------
        ValueError
            If there is too much of anything.
        """
        number = coder.count("submap", MAX_SUBMAPS - 1, packed.id if packed else 0)
        lines = PackedLines.code(coder, packed.lines if packed else None)
        trajectory = code_trajectory(coder, packed.trajectory if packed else None, clock)
        return cls(number, lines, trajectory)

    @cached_property
    def digest(self) -> bytes:
        """Tells apart the forms of a submap that still grows."""
        columns = [*self.lines.columns, np.array(self.trajectory.rows.shape), self.trajectory.rows]
        return digest_of(columns)

    @cached_property
    def restored(self) -> Submap:
        """The submap, at the origin of component 0.

        Raises
        ------
        ValueError
            If something is out of bounds.
        """
        lines = self.lines.unpack(SUBMAP_REACH)
        return Submap(self.id, 0, np.zeros(3), lines, self.trajectory.restore(SUBMAP_REACH))


_held: WeakValueDictionary[tuple[int, bytes], PackedSubmap] = WeakValueDictionary()


def decode_submaps(decoder: Coder) -> Iterator[PackedSubmap]:
    """Yield the submaps that `SubmapStream` encoded.

    One that is held here already, as of the message before, is the same object: it is not restored
    and checked again.

    Raises
    ------
    ValueError
        If there is too much of anything.
    """
    clock = Clock()
    for _ in range(MAX_SUBMAPS + 1):
        if not decoder.bit(ANOTHER):
            return
        packed = PackedSubmap.code(decoder, None, clock)
        yield _held.setdefault((packed.id, packed.digest), packed)
    raise ValueError(f"more than {MAX_SUBMAPS} submaps")


class SubmapStream:
    """Encodes the submaps of a map as it grows: those that are as they were are coded once.

    All but the last few settle, and the state of an encoder behind these is where the next one
    goes on.
    """

    def __init__(self) -> None:
        self._keys: list[tuple[int, bytes]] = []
        self._stages: dict[int, tuple[Encoder, Clock]] = {}  # by number of submaps coded

    def encoder(self, submaps: Sequence[PackedSubmap]) -> Encoder:
        """Return an encoder, the caller's, that has coded `submaps`.

        Raises
        ------
        ValueError
            If there is too much of anything.
        """
        keys = [(packed.id, packed.digest) for packed in submaps]
        same = next(
            (k for k, (new, old) in enumerate(zip(keys, self._keys, strict=False)) if new != old),
            min(len(keys), len(self._keys)),
        )
        stages = {k: stage for k, stage in self._stages.items() if k <= same}
        begin = max(stages, default=0)
        encoder, clock = stages.get(begin, (entropy.encoder(), Clock()))
        encoder, clock = encoder.copy(), replace(clock)
        for number, packed in enumerate(submaps[begin:], start=begin + 1):
            encoder.bit(ANOTHER, 1)
            PackedSubmap.code(encoder, packed, clock)
            if number > len(submaps) - STAGES:
                stages[number] = encoder.copy(), replace(clock)
        self._keys, self._stages = keys, {k: stages[k] for k in sorted(stages)[-STAGES:]}
        encoder.bit(ANOTHER, 0)
        return encoder


def digest_of(columns: list[IntArray]) -> bytes:
    """Return the digest of all the numbers, each as 8 bytes, the lowest first."""
    numbers = b"".join(whole_numbers(column).astype("<i8").tobytes() for column in columns)
    return blake2b(numbers, digest_size=DIGEST_SIZE).digest()
