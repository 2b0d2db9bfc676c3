"""How sure each segment of a joint map is: by the scans that saw it, and the robots' vote."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray, IntArray
from mapweave.maps import LineMap
from mapweave.matching.distance_field import DistanceField
from mapweave.parameters import StageParameters, derived
from mapweave.scan.points import points_on_lines


class SegmentConfidenceParameters(StageParameters):
    """When a map confirms a wall, and when it denies it."""

    spacing: float = derived(
        lambda c: 2 * c.mapping.resolution, gt=0, description="[m] between samples of a wall"
    )
    closeness: float = derived(
        lambda c: 1.2 * c.mapping.closeness,
        gt=0,
        description="[m] to a wall of its own, to confirm",
    )
    clearance: float = derived(
        lambda c: c.mapping.clearance, gt=0, description="[m] inside its free space, to deny"
    )


SILENT, CONFIRMS, DENIES = range(3)
SIDE_BY_SIDE = 4  # cells in a byte, two bits each


@dataclass(frozen=True, slots=True, eq=False)
class Witness:
    """What a piece says of walls, by place: two bits a cell, of all that its raster knows.

    A team has hundreds of pieces, each with tens of thousands of cells.

    Attributes
    ----------
    origin
        (2,) the corner [m], frame of the piece.
    cell
        [m].
    shape
        Rows and columns.
    said
        (rows, columns / 4, rounded up) whether a wall there is confirmed or denied, the first of
        four cells in the lowest bits.
    """

    origin: FloatArray
    cell: float
    shape: tuple[int, int]
    said: NDArray[np.uint8]

    @classmethod
    def of(cls, raster: DistanceField, p: SegmentConfidenceParameters) -> "Witness":
        """Return what the piece that `raster` is of says."""
        rows, columns = raster.distance.shape
        said = np.full((rows, -(-columns // SIDE_BY_SIDE) * SIDE_BY_SIDE), SILENT, dtype=np.uint8)
        said[:, :columns][raster.depth > p.clearance] = DENIES
        said[:, :columns][raster.distance <= p.closeness] = CONFIRMS
        parts = [said[:, k::SIDE_BY_SIDE] << 2 * k for k in range(SIDE_BY_SIDE)]
        return cls(raster.origin, raster.cell, (rows, columns), np.bitwise_or.reduce(parts))

    def at(self, rows: IntArray, columns: IntArray) -> NDArray[np.uint8]:
        """Return (n,) what it says in the cells of (n,) `rows` and `columns`."""
        four = self.said[rows, columns >> 2]
        return np.asarray(four >> ((columns & 3) << 1).astype(np.uint8) & 3)


@dataclass(frozen=True, slots=True, eq=False)
class Voices:
    """What was said of walls when they were joined before.

    Attributes
    ----------
    view
        (n,) of each wall the place among the views of the one that it is of; -1 of a new wall.
    share
        (n,) of what was said of it then that confirmed it, in [0, 1]; 1 of a new wall.
    """

    view: IntArray
    share: FloatArray


def segment_confidence(
    lines: LineMap,
    views: Sequence[Sequence[tuple[Witness, FloatArray]]],
    parameters: SegmentConfidenceParameters,
    before: Voices | None = None,
) -> FloatArray:
    """Return (n,) in [0, 1]: more with every scan and map that saw it, less with every denial.

    n sightings give n / (n + 1), Laplace's rule for what was never denied. Of the maps that
    looked there, c confirm and d deny: c / (c + d) of it is left, averaged along the segment.

    Parameters
    ----------
    views
        The maps that were joined, each of one piece or more with its (3,) pose in the frame of
        `lines`. A map has one voice: where one piece has a wall and another saw through, the wall.
    before
        What the views that were joined before said of their own walls: that voice is divided as
        those were that they were made of.
    """
    if len(lines.segments) == 0:
        return np.empty(0)
    oriented, owner = points_on_lines(lines, parameters.spacing)
    before = before or Voices(np.full(len(lines.segments), -1), np.ones(len(lines.segments)))
    old, share = before.view[owner], before.share[owner]
    confirm, deny = np.where(old >= 0, share, 0.0), np.where(old >= 0, 1.0 - share, 0.0)
    for number, pieces in enumerate(views):
        if not pieces:
            continue
        near = np.zeros(len(oriented), dtype=np.bool_)
        through = near.copy()
        for known, said in _heard(pieces, oriented.points):
            near[known] |= said == CONFIRMS
            through[known] |= said == DENIES
        confirm += near & (old != number)
        deny += through & ~near & (old != number)
    # What nobody confirms at this very place was merged from walls close by: one voice for it.
    confirm = np.where(old >= 0, confirm, np.maximum(confirm, 1))
    left = confirm / (confirm + deny)
    agreed = np.bincount(owner, weights=left) / np.bincount(owner)
    return np.asarray(lines.support / (lines.support + 1.0) * agreed)


def _heard(
    pieces: Sequence[tuple[Witness, FloatArray]], points: FloatArray
) -> Iterator[tuple[IntArray, NDArray[np.uint8]]]:
    """Yield which of (n, 2) `points` each piece knows of, and what it says of each.

    There are hundreds of pieces, of few points each: only those beside it are looked at.
    """
    order = np.argsort(points[:, 0])
    x, y = points[order].T
    low, high = np.array([_bounds(witness, pose) for witness, pose in pieces]).T
    begins, ends = (np.searchsorted(x, bound).tolist() for bound in (low, high))
    back = se2.inverse(np.array([pose for _, pose in pieces])).tolist()
    for (witness, _), (dx, dy, turn), begin, end in zip(pieces, back, begins, ends, strict=True):
        c, s = math.cos(turn), math.sin(turn)
        (left, bottom), (rows, columns) = witness.origin.tolist(), witness.shape
        here, up = x[begin:end], y[begin:end]
        i = (here * c - up * s + (dx - left)) / witness.cell
        j = (here * s + up * c + (dy - bottom)) / witness.cell
        known = np.flatnonzero((i >= 0) & (j >= 0) & (i < rows) & (j < columns))
        said = witness.at(i[known].astype(np.int64), j[known].astype(np.int64))
        yield order[begin:end][known], said


def _bounds(witness: Witness, pose: FloatArray) -> tuple[float, float]:
    """Return between which x [m] a piece at `pose` (3,) knows anything."""
    (x, _, turn), (left, bottom), (rows, columns) = pose, witness.origin, witness.shape
    c, s = math.cos(turn), math.sin(turn)
    first = x + c * left - s * bottom
    run, rise = c * witness.cell * rows, -s * witness.cell * columns
    return (
        first + min(run, 0.0) + min(rise, 0.0) - witness.cell,
        first + max(run, 0.0) + max(rise, 0.0) + witness.cell,
    )
