"""Rays: what each meets first among faces that are seen from one side."""

from dataclasses import dataclass

import numpy as np

from mapweave.geometry.arrays import FloatArray, IntArray


@dataclass(frozen=True, slots=True, eq=False)
class Hits:
    """What each ray meets first.

    Attributes
    ----------
    range
        (n,) distance [m]; infinite where a ray meets nothing.
    wall
        (n,) row of the segment met; meaningless where it meets nothing.
    grazing
        (n,) angle between ray and surface [rad], 0 to pi/2.
    """

    range: FloatArray
    wall: IntArray
    grazing: FloatArray


def cast_rays(walls: FloatArray, origin: FloatArray, directions: FloatArray) -> Hits:
    """Return what rays from `origin` (2,) in `directions` (n,) [rad] meet among `walls` (m, 4).

    Only the visible side of a wall, its left, is ever met. The ray ``o + r d`` and the segment
    ``a + u (b - a)`` meet where ``r = cross(a - o, b - a) / cross(d, b - a)`` and
    ``u = cross(a - o, d) / cross(d, b - a)``; seen from the left both divisors are positive.
    """
    start, along = walls[:, :2] - origin, walls[:, 2:] - walls[:, :2]
    offset = start[:, 0] * along[:, 1] - start[:, 1] * along[:, 0]
    facing = np.flatnonzero(offset > 0)
    if len(facing) == 0:
        nothing = np.zeros(len(directions), dtype=np.int64)
        return Hits(np.full(len(directions), np.inf), nothing, np.zeros(len(directions)))
    start, along, offset = start[facing], along[facing], offset[facing]
    c, s = np.cos(directions), np.sin(directions)
    sine = np.outer(c, along[:, 1]) - np.outer(s, along[:, 0])
    share = np.outer(s, start[:, 0]) - np.outer(c, start[:, 1])
    met = (sine > 0) & (share >= 0) & (share <= sine)
    distance = np.divide(offset[None], sine, out=np.full(sine.shape, np.inf), where=met)
    first = np.argmin(distance, axis=1)
    rows = np.arange(len(directions))
    slope = sine[rows, first] / np.linalg.norm(along, axis=1)[first]
    return Hits(distance[rows, first], facing[first], np.arcsin(np.clip(slope, 0.0, 1.0)))
