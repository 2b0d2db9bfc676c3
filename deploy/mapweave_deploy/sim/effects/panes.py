"""Glass and mirrors: what a ray meets that goes through, or is sent on.

Glass returns a beam that meets it nearly square; another goes on to what is behind. A mirror
shows what is before it, as if it were behind.
"""

import numpy as np
from numpy.random import Generator

from mapweave.geometry.arrays import BoolArray, FloatArray
from mapweave_deploy.sim.effects.rays import Hits, cast_rays

SQUARE = np.radians(82.0)  # [rad] between ray and pane, from which glass returns a beam
DUSTY = 0.03  # share of the others that come back from the pane as well
NO_WALL = -1  # as the wall that a ray met


def look(
    walls: FloatArray,
    glass: FloatArray,
    mirrors: FloatArray,
    origin: FloatArray,
    directions: FloatArray,
    rng: Generator,
) -> Hits:
    """Return what a lidar at `origin` (2,) takes for the first thing along `directions` (n,)."""
    seen = cast_rays(walls, origin, directions)
    for mirror in mirrors:
        met = cast_rays(mirror[None], origin, directions)
        before = met.range < seen.range
        if before.any():
            seen = _replaced(seen, before, _in_mirror(walls, mirror, origin, directions, met))
    if len(glass):
        pane = cast_rays(glass, origin, directions)
        returned = (pane.grazing > SQUARE) | (rng.random(len(directions)) < DUSTY)
        before = (pane.range < seen.range) & returned
        nowhere = np.full(len(directions), NO_WALL, dtype=np.int64)
        seen = _replaced(seen, before, Hits(pane.range, nowhere, pane.grazing))
    return seen


def _replaced(seen: Hits, where: BoolArray, by: Hits) -> Hits:
    return Hits(
        np.where(where, by.range, seen.range),
        np.where(where, by.wall, seen.wall),
        np.where(where, by.grazing, seen.grazing),
    )


def _in_mirror(
    walls: FloatArray, mirror: FloatArray, origin: FloatArray, directions: FloatArray, met: Hits
) -> Hits:
    """Return what rays meet after a mirror: the walls before it, where it shows them."""
    start, along = mirror[:2], mirror[2:] - mirror[:2]
    along = along / np.hypot(*along)
    left = np.array([-along[1], along[0]])
    ends = walls.reshape(-1, 2, 2)
    before = ((ends - start) @ left).max(axis=1) > 1e-6
    depth = (ends[before] - start) @ left
    # What a mirror shows is turned round: so is which side of a wall is its left.
    shown = (ends[before] - 2 * depth[..., None] * left)[:, ::-1]
    found = cast_rays(shown.reshape(-1, 4), origin, directions)
    beyond = found.range > met.range
    index = np.flatnonzero(before)[np.minimum(found.wall, max(before.sum() - 1, 0))]
    return Hits(np.where(beyond, found.range, np.inf), index, found.grazing)
