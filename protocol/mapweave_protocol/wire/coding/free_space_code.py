"""Free space as whole numbers, and these as a stream.

Free space ends some 0.15 m before what beams hit, and counts against a wall only where that lies
`clearance`, 0.3 m, deep in it. So its outline may deviate by more than walls may: by no more than
the two together leave of it.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from mapweave.geometry.arrays import FloatArray, IntArray
from mapweave.kernels.range_coder import Coder
from mapweave_protocol.wire import packing
from mapweave_protocol.wire.coding.line_code import code_quarter, turned, turned_back

PER_METRE = 4  # a step of 0.25 m: no corner moves by more than 0.18 m
DEPTH = 0.3  # [m]: `clearance`; what is nowhere that deep counts against no wall
DEVIATION = 0.25  # [m] by which an outline is straightened before
MAX_VERTICES = 400_000  # of one line map

Outline: TypeAlias = tuple[IntArray, ...]
"""The outside of an area and its holes, each (k, 2)."""


@dataclass(frozen=True, slots=True, eq=False)
class CodedFreeSpace:
    """Areas with holes as whole numbers, in a frame turned like that of the lines."""

    areas: tuple[Outline, ...]

    @classmethod
    def of(cls, rings: Sequence[FloatArray], turn: int, reach: float) -> "CodedFreeSpace":
        """Return what `rings`, simple polygons without holes, cover.

        Raises
        ------
        ValueError
            If something is not finite, or beyond `reach` [m].
        """
        if not rings:
            return cls(())
        from mapweave_protocol.wire.coding.outlines import (
            straightened,  # loads shapely: senders only
        )

        packing.quantise(np.concatenate(rings), 1.0, reach)
        steps = [turned(ring, turn) * PER_METRE for ring in rings]
        return cls(straightened(steps, DEPTH * PER_METRE, DEVIATION * PER_METRE))

    def restore(self, turn: int, reach: float) -> tuple[FloatArray, ...]:
        """Return simple polygons without holes that cover the areas [m].

        Raises
        ------
        ValueError
            If an area with holes is none, or something is beyond `reach` [m].
        """
        rings: list[FloatArray] = []
        for outside, *holes in self.areas:
            if holes:
                from mapweave_protocol.wire.coding.outlines import cut_open  # loads shapely

                rings += cut_open(outside, holes)
            else:
                rings.append(outside.astype(float))
        metres = [turned(ring / PER_METRE, -turn) for ring in rings]
        if metres:
            packing.quantise(np.concatenate(metres), 1.0, 1.01 * reach)
        return tuple(metres)


def code_free_space(coder: Coder, free: CodedFreeSpace | None) -> CodedFreeSpace:
    """Code `free` with an encoder, or return what a decoder finds.

    Raises
    ------
    ValueError
        If there are too many vertices.
    """
    rings = _Rings(coder)
    areas = []
    for number in range(coder.count("areas", MAX_VERTICES, len(free.areas) if free else 0)):
        area = free.areas[number] if free else None
        holes = coder.count("holes", MAX_VERTICES, len(area) - 1 if area else 0)
        areas.append(tuple(rings.code(area[k] if area else None) for k in range(1 + holes)))
    return CodedFreeSpace(tuple(areas))


class _Rings:
    """Goes from ring to ring, and around each."""

    def __init__(self, coder: Coder) -> None:
        self._coder = coder
        self._start = (0, 0)
        self._left = MAX_VERTICES

    def code(self, ring: IntArray | None) -> IntArray:
        """Code a ring of three vertices or more."""
        given = None if ring is None else ring.tolist()
        more = 0 if given is None else len(given) - 3
        count = 3 + self._coder.count("vertices", max(self._left - 3, 0), more)
        self._left -= count
        x, y = given[0] if given else (0, 0)
        x = self._start[0] + self._coder.signed("ring", x - self._start[0])
        y = self._start[1] + self._coder.signed("ring", y - self._start[1])
        self._start = x, y
        points, quarter, bend = [(x, y)], 0, 0
        for number in range(1, count):
            end = given[number] if given else (x, y)
            dx, dy, quarter, bend = self._way(end[0] - x, end[1] - y, quarter, bend)
            x, y = x + dx, y + dy
            points.append((x, y))
        return packing.whole_numbers(points)

    def _way(self, dx: int, dy: int, quarter: int, bend: int) -> tuple[int, int, int, int]:
        """Code an edge; return it, along which axis it points, and to which side it deviates."""
        quarter = code_quarter(self._coder, ("edge", bend), quarter, dx, dy)
        ahead, aside = turned_back(quarter, dx, dy)
        ahead = self._coder.unsigned("edge length", ahead)
        aside = self._coder.signed(("edge across", min(ahead.bit_length(), 5)), aside)
        dx, dy = turned_back(-quarter, ahead, aside)
        return dx, dy, quarter, (aside > 0) - (aside < 0)
