"""Points and paths in polygons, by their edges: inside is where a ray crosses an odd number."""

from typing import cast

import numpy as np

from mapweave.kernels.loading import COMPILED
from mapweave.kernels.point_map import Bools, Floats


def depths_numpy(points: Floats, edges: Floats, most: float) -> Floats:
    """Twin of `depths`."""
    (x, y), depth = points.T, np.full(len(points), most)
    for ax, ay, bx, by in edges:
        run = np.array([bx - ax, by - ay])
        part = np.clip((points - [ax, ay]) @ run / max(run @ run, 1e-300), 0, 1)
        away = points - [ax, ay] - part[:, None] * run
        depth = np.minimum(depth, np.hypot(away[:, 0], away[:, 1]))
    return np.where(_contains(x, y, edges), depth, 0.0)


def lengths_inside_numpy(paths: Floats, edges: Floats) -> Floats:
    """Twin of `lengths_inside`."""
    total = np.zeros(len(paths))
    for before, after in zip(
        paths[:, :-1].swapaxes(0, 1), paths[:, 1:].swapaxes(0, 1), strict=True
    ):
        inside = _contains(before[:, 0], before[:, 1], edges)
        for k, (a, run) in enumerate(zip(before, after - before, strict=True)):
            length = np.hypot(run[0], run[1])
            if length > 0:
                at = np.array([0.0, *_crossings(a, run, edges), 1.0])
                kept = np.diff(at)[(0 if inside[k] else 1) :: 2]
                total[k] += length * kept.sum()
    return total


def _contains(x: Floats, y: Floats, edges: Floats) -> Bools:
    inside = np.zeros(len(x), dtype=np.bool_)
    for ax, ay, bx, by in edges:
        crosses = (ay <= y) != (by <= y)
        if crosses.any():
            inside ^= crosses & (ax + (y - ay) / (by - ay if by != ay else 1.0) * (bx - ax) > x)
    return inside


def _crossings(start: Floats, run: Floats, edges: Floats) -> Floats:
    """(k,) where the way of `run` (2,) from `start` (2,) crosses edges, as shares of it."""
    first, second = (
        run[0] * (edges[:, c + 1] - start[1]) - run[1] * (edges[:, c] - start[0]) for c in (0, 2)
    )
    crossed = np.flatnonzero((first <= 0) != (second <= 0))
    part = first[crossed] / (first[crossed] - second[crossed])
    places = edges[crossed, :2] + part[:, None] * (edges[crossed, 2:] - edges[crossed, :2])
    at = (places - start) @ run / (run @ run)
    return np.sort(at[(at > 0) & (at < 1)])


def depths(points: Floats, edges: Floats, most: float) -> Floats:
    """Return (n,) how deep [m] inside polygons (n, 2) `points` lie, `most` at the most; 0 outside.

    Parameters
    ----------
    edges
        (k, 4) x1 y1 x2 y2 [m] of all rings, of holes as well.

    Raises
    ------
    ValueError
        Where shapes do not agree.
    """
    compute = depths_numpy if COMPILED is None else COMPILED.depths
    return cast("Floats", compute(points, edges, most))


def lengths_inside(paths: Floats, edges: Floats) -> Floats:
    """Return (n,) how much [m] of each of (n, k, 2) `paths` is inside polygons.

    Parameters
    ----------
    edges
        As of `depths`.

    Raises
    ------
    ValueError
        Where shapes do not agree.
    """
    compute = lengths_inside_numpy if COMPILED is None else COMPILED.lengths_inside
    return cast("Floats", compute(paths, edges))
