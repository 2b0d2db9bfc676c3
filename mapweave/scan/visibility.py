"""What a scan saw through: every beam proves the space before its return to be free."""

from collections.abc import Sequence

import numpy as np

from mapweave.geometry.arrays import BoolArray, FloatArray, IntArray
from mapweave.kernels.clearing import Sights
from mapweave.scan.scan import Scan

GRAZING = 0.2  # cosine between a beam and a surface's normal, below which it tells little


def clear_ranges(scan: Scan, max_range: float) -> FloatArray:
    """Return (beams,) how far [m] each beam and both its neighbours saw nothing.

    The neighbours count because space between two beams is only known to be free as far as both
    reach. A beam that did not come back proves nothing (glass, black cloth): 0.

    Parameters
    ----------
    scan
        One sweep.
    max_range
        [m] beyond which a beam proves nothing.
    """
    reach = np.minimum(scan.ranges, max_range)
    reach[np.isnan(reach)] = 0.0
    padded = np.concatenate([reach[:1], reach, reach[-1:]])
    clear: FloatArray = np.minimum(np.minimum(padded[:-2], padded[1:-1]), padded[2:])
    return clear


def seen_through(
    scan: Scan, points: FloatArray, margin: FloatArray | float, max_range: float
) -> BoolArray:
    """Tell which (n, 2) `points` [m], sensor frame, lie where `scan` saw free space.

    Parameters
    ----------
    scan
        One sweep.
    points
        (n, 2) [m], sensor frame.
    margin
        [m] how much nearer than what the beam hit a point must be: scalar or (n,).
    max_range
        [m] beyond which a beam proves nothing.
    """
    clear = clear_ranges(scan, max_range)
    beam, inside = _beams(scan, np.arctan2(points[:, 1], points[:, 0]))
    before: BoolArray = np.hypot(points[:, 0], points[:, 1]) < clear[beam] - margin
    through: BoolArray = inside & before
    return through


def beams_through(
    scan: Scan, points: FloatArray, normals: FloatArray, margin: float, max_range: float
) -> int:
    """Return how many beams of `scan` go through known surfaces and end on none of them.

    A beam that ends on one is where it should be: what it went through has gone. Surfaces behind
    what a beam hit, beside all beams, or seen from behind tell nothing.

    Parameters
    ----------
    scan
        One sweep.
    points, normals
        (n, 2) known surfaces [m], and unit vectors to the side that was seen, sensor frame.
    margin
        [m] across a surface, by which a beam that ends on one may be off, and one that goes
        through must be.
    max_range
        [m] beyond which no surface counts.
    """
    distance = np.hypot(points[:, 0], points[:, 1])
    beam, inside = _beams(scan, np.arctan2(points[:, 1], points[:, 0]))
    facing = -np.einsum("ij,ij->i", points, normals) / np.maximum(distance, 1e-9)
    shown = inside & (distance < max_range) & (facing > GRAZING)
    beam, distance, facing = beam[shown], distance[shown], facing[shown]
    ends = np.abs(scan.ranges[beam] - distance) * facing < margin
    through = (clear_ranges(scan, max_range)[beam] - distance) * facing > margin
    return len(np.setdiff1d(beam[through], beam[ends]))


def beam_spacing(scan: Scan) -> float:
    """Return the angle between neighbouring beams [rad]."""
    return float((scan.angles[-1] - scan.angles[0]) / max(len(scan.angles) - 1, 1))


def beams_at(scan: Scan, points: FloatArray) -> IntArray:
    """Return (n,) which beam of `scan` points nearest to each of `points` (n, 2), sensor frame."""
    return _beams(scan, np.arctan2(points[:, 1], points[:, 0]))[0]


def _beams(scan: Scan, bearing: FloatArray) -> tuple[IntArray, BoolArray]:
    """Return (n,) which beam points nearest to each `bearing` [rad], and whether one does.

    Bearings are counted from the first beam on, so that it does not matter where a turn begins.
    """
    count = len(scan.angles)
    spacing = beam_spacing(scan)
    turn = 2 * np.pi
    steps = np.mod(bearing - scan.angles[0], turn) / spacing
    closed = count * spacing > turn - spacing / 2  # the last beam and the first are neighbours
    inside: BoolArray = (steps <= count - 1) | closed
    beam: IntArray = np.rint(steps).astype(np.int64)
    beam[beam >= count] = 0
    return beam, inside


def sights_of(scans: Sequence[Scan], poses: FloatArray, max_range: float) -> Sights:
    """Return what `scans`, taken at (n, 3) `poses`, saw through, up to `max_range` [m].

    Of each beam as `clear_ranges` tells.
    """
    start = np.concatenate([[0], np.cumsum([len(scan.ranges) for scan in scans], dtype=np.int64)])
    none = np.empty(0)
    ranges = np.concatenate([none, *(scan.ranges for scan in scans)])
    reach = np.minimum(np.nan_to_num(ranges, nan=0.0), max_range)
    before, after = np.roll(reach, 1), np.roll(reach, -1)
    first, last = start[:-1], start[1:] - 1
    before[first], after[last] = reach[first], reach[last]
    clear = np.minimum(np.minimum(before, reach), after)
    angles = np.concatenate([none, *(scan.angles for scan in scans)])
    return Sights(angles, clear, start, np.ascontiguousarray(poses, dtype=np.float64))
