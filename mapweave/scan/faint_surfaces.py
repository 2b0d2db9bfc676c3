"""Surfaces of which a beam comes back now and then: glass, black lacquer.

A beam that did not come back proves nothing by itself. But where lone beams came back from one
place in scan after scan something stands, and those that are lost on the way there went no farther:
what is before it is free. From a way on into the dark nothing comes back at all.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from pydantic import Field

from mapweave.geometry import se2
from mapweave.geometry.arrays import BoolArray, FloatArray, IntArray
from mapweave.parameters import StageParameters, derived
from mapweave.scan.scan import Scan

ROWS = 2**21  # of cells that a number can tell, either way of the origin the half


class FaintSurfaceParameters(StageParameters):
    """What is taken for such a surface."""

    sight: float = derived(
        lambda c: c.mapping.free_range, gt=0, description="[m] beyond, beams are too far apart"
    )
    cell: float = derived(
        lambda c: 0.5 * c.mapping.resolution, gt=0, description="[m] of the raster it is drawn in"
    )
    spread: float = Field(
        0.15, gt=0, description="[m] about a lone return, in which its surface goes on"
    )
    scans: int = Field(3, ge=1, description="of which a lone beam came back from there, at least")


def up_to_faint_surfaces(
    scans: Sequence[Scan], poses: FloatArray, parameters: FaintSurfaceParameters
) -> list[Scan]:
    """Return `scans` with the beams that were lost on faint surfaces ending there.

    Parameters
    ----------
    scans
        Of one region.
    poses
        (n, 3) [m, m, rad] where they were taken.
    parameters
        What is such a surface.
    """
    p = parameters
    placed = list(zip(scans, poses, strict=True))
    faint = _faint([_cells(scan, pose, _is_lone(scan), p) for scan, pose in placed], p)
    if not len(faint):
        return list(scans)
    others = [_cells(scan, pose, ~_is_lone(scan), p) for scan, pose in placed]
    solid = np.setdiff1d(np.concatenate(others), faint)
    surface, before = _middles(faint, p.cell), _middles(solid, p.cell)
    return [
        _ended(scan, _in_sight(surface, pose, p.sight), _in_sight(before, pose, p.sight), p.cell)
        for scan, pose in placed
    ]


def _is_lone(scan: Scan) -> BoolArray:
    """(beams,) whether a beam came back between two that were lost."""
    came = ~np.isnan(scan.ranges)
    beside = np.concatenate([[True], came, [True]])
    return np.asarray(came & ~beside[:-2] & ~beside[2:])


def _cells(scan: Scan, pose: FloatArray, chosen: BoolArray, p: FaintSurfaceParameters) -> IntArray:
    """(n,) in which the `chosen` beams, those that came back from near, ended."""
    ended = scan.points[chosen & (np.nan_to_num(scan.ranges, nan=np.inf) < p.sight)]
    column, row = np.floor(se2.transform_points(pose, ended) / p.cell).astype(np.int64).T
    return np.asarray((row + ROWS // 2) * ROWS + column + ROWS // 2)


def _faint(lone: Sequence[IntArray], p: FaintSurfaceParameters) -> IntArray:
    """Return the cells about which lone beams of several scans came back, ascending."""
    reach = round(p.spread / p.cell)
    row, column = (each.ravel() for each in np.mgrid[-reach : reach + 1, -reach : reach + 1])
    about = (row * ROWS + column)[np.hypot(row, column) <= reach]
    of_each = [np.unique(cells[:, None] + about) for cells in lone if len(cells)]
    if not of_each:
        return np.empty(0, dtype=np.int64)
    cells, counts = np.unique(np.concatenate(of_each), return_counts=True)
    return np.asarray(cells[counts >= p.scans])


def _in_sight(points: FloatArray, pose: FloatArray, sight: float) -> FloatArray:
    """Return those of (n, 2) `points` [m] that are near `pose` (3,), in its frame."""
    near = np.hypot(*(points - pose[:2]).T) < sight
    return se2.transform_points(se2.inverse(pose), points[near])


def _ended(scan: Scan, faint: FloatArray, solid: FloatArray, cell: float) -> Scan:
    """Return `scan` with its lost beams ending at `faint` cells (k, 2), before which is no solid.

    Both are the middles of cells of `cell` [m] in the sensor's frame [m].
    """
    if not len(faint):
        return scan
    lost = np.isnan(scan.ranges)
    first = _first_met(scan, lost, faint, cell)
    farthest = first.max(initial=0.0, where=np.isfinite(first))
    nearer = solid[np.hypot(*solid.T) < farthest]
    met = first < _first_met(scan, lost, nearer, cell)
    ranges = scan.ranges.copy()
    ranges[np.flatnonzero(lost)[met]] = first[met]
    return replace(scan, ranges=ranges)


def _first_met(scan: Scan, lost: BoolArray, cells: FloatArray, cell: float) -> FloatArray:
    """Return how far [m] it is to the first of `cells` (k, 2) on each `lost` beam; inf: on none."""
    bearing = scan.angles[lost] - scan.angles[0]
    away = np.maximum(np.hypot(*cells.T), cell)
    at = np.mod(np.arctan2(cells[:, 1], cells[:, 0]) - scan.angles[0], 2 * np.pi)
    half = np.arctan(cell / 2 / away)
    begin, end = np.searchsorted(bearing, at - half), np.searchsorted(bearing, at + half)
    counts = end - begin
    beam = np.arange(counts.sum()) + np.repeat(begin - np.cumsum(counts) + counts, counts)
    first = np.full(len(bearing), np.inf)
    np.minimum.at(first, beam, np.repeat(away, counts))
    return first


def _middles(numbers: IntArray, cell: float) -> FloatArray:
    """(n, 2) [m] of cells."""
    row, column = np.divmod(numbers, ROWS)
    return (np.column_stack([column, row]) - ROWS // 2 + 0.5) * cell
