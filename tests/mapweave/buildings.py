"""Places whose truth is known in closed form, and a ray-cast laser: what the tests map and join.

A place is one outline, counter-clockwise round its inside, so that every wall's visible side is on
its left; things that stand inside are outlines that run clockwise.
"""

from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np
import shapely
from numpy.random import Generator
from numpy.typing import ArrayLike

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.maps import LineMap
from mapweave.scan.scan import Scan

FRONT = np.radians(np.linspace(-90, 90, 181))
AROUND = np.radians(np.linspace(-180, 179, 360))
MARGIN = 0.15  # [m] kept from the walls by what was seen to be free
Niche = tuple[float, float, float]  # from x, to x, depth [m]


def walls_of(corners: ArrayLike) -> FloatArray:
    """Return the (k, 4) walls along (k, 2) `corners` [m] of a closed outline."""
    points = np.asarray(corners, dtype=float)
    return np.hstack([points, np.roll(points, -1, axis=0)])


def rectangle(left: float, bottom: float, right: float, top: float) -> FloatArray:
    """Return the (4, 2) corners of a room [m], counter-clockwise."""
    return np.array([[left, bottom], [right, bottom], [right, top], [left, top]])


def corridor(
    length: float, below: Sequence[Niche], above: Sequence[Niche], width: float = 2.2
) -> FloatArray:
    """Return the (k, 2) corners [m] of a corridor along x with niches (rooms, if deep)."""
    right = [
        point for a, b, deep in below for point in [(a, 0.0), (a, -deep), (b, -deep), (b, 0.0)]
    ]
    back = [
        point
        for a, b, deep in reversed(above)
        for point in [(b, width), (b, width + deep), (a, width + deep), (a, width)]
    ]
    return np.array([(0.0, 0.0), *right, (length, 0.0), (length, width), *back, (0.0, width)])


# No two places in it look alike.
BUILDING = corridor(
    30.0,
    below=[(2, 5, 3.0), (7, 7.9, 0.4), (11, 15, 4.2), (18, 18.9, 0.5), (22, 26, 3.0)],
    above=[(1, 3.5, 2.5), (6, 10, 3.6), (13, 14, 0.6), (16.5, 21, 2.8), (24, 25.5, 1.2)],
)
OTHER_BUILDING = corridor(
    26.0,
    below=[(1, 2.2, 0.7), (6, 12, 5.0), (15, 17, 1.6), (20, 24.5, 2.2)],
    above=[(3, 4, 1.9), (8, 9.5, 0.3), (11, 16.5, 3.3), (22.5, 24, 4.0)],
    width=3.1,
)

# The same with a wall askew in two rooms, as no two wings have it: whoever saw it knows the place.
SLANTED = BUILDING.copy()
SLANTED[[19, 40], 0] -= 1.2


def part(outline: FloatArray, low: float, high: float) -> LineMap:
    """Return what a robot would know that saw `outline` from x = `low` to x = `high` [m]."""
    window = shapely.box(low, outline[:, 1].min(), high, outline[:, 1].max())
    walls = [w for w in (clip(wall, low, high) for wall in walls_of(outline)) if w is not None]
    free = shapely.Polygon(outline).buffer(-MARGIN).intersection(window)
    rings = tuple(np.array(p.exterior.coords)[:-1] for p in shapely.get_parts(free))
    return line_map(np.array(walls), rings)


def clip(wall: FloatArray, low: float, high: float) -> FloatArray | None:
    """Return what of `wall` (4,) [m] lies at `low` <= x <= `high`, in its direction."""
    start, along = wall[:2], wall[2:] - wall[:2]
    if along[0] == 0:
        return wall if low <= wall[0] <= high else None
    ends = np.sort((np.array([low, high]) - start[0]) / along[0])
    a, b = np.clip(ends, 0, 1)
    return np.concatenate([start + a * along, start + b * along]) if b - a > 1e-6 else None


def line_map(
    walls: FloatArray, free_space: tuple[FloatArray, ...] = (), support: int = 5
) -> LineMap:
    """Return a map of (n, 4) `walls`; those that touch, one after the other, are a polyline."""
    apart = np.hypot(*(walls[1:, :2] - walls[:-1, 2:]).T) > 0.5
    polyline = np.concatenate([[0], np.cumsum(apart)]).astype(np.int64)
    return LineMap(walls, polyline, np.full(len(walls), support), free_space)


def shaken(lines: LineMap, rng: Generator, sigma: float = 0.02) -> LineMap:
    """Return `lines` with ends that err by `sigma` [m]."""
    noise = rng.normal(0.0, sigma, lines.segments.shape)
    return LineMap(lines.segments + noise, lines.polyline, lines.support, lines.free_space)


def random_pose(rng: Generator, reach: float = 20.0) -> FloatArray:
    """Return a (3,) rigid motion of up to `reach` [m] and any turn."""
    return np.array([*rng.uniform(-reach, reach, 2), rng.uniform(-np.pi, np.pi)])


def cast(
    walls: FloatArray,
    pose: ArrayLike,
    *,
    index: int = 0,
    angles: FloatArray = FRONT,
    noise: Generator | None = None,
    max_range: float = 30.0,
) -> Scan:
    """Return the scan of (n, 4) `walls` from `pose` (3,); noise, if any, of 1 cm."""
    at = np.asarray(pose, dtype=float)
    start, along = walls[:, :2] - at[:2], walls[:, 2:] - walls[:, :2]
    beams = np.column_stack([np.cos(at[2] + angles), np.sin(at[2] + angles)])
    # Ray r d meets wall s + u a where r = s x a / d x a and u = s x d / d x a.
    turned = beams[:, :1] * along[:, 1] - beams[:, 1:] * along[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        distance = (start[:, 0] * along[:, 1] - start[:, 1] * along[:, 0]) / turned
        share = (start[:, 0] * beams[:, 1:] - start[:, 1] * beams[:, :1]) / turned
    met = (distance > 0) & (share >= 0) & (share <= 1)
    ranges = np.where(met, distance, np.inf).min(axis=1)
    if noise is not None:
        ranges = ranges + noise.normal(0.0, 0.01, len(ranges))
    return Scan(np.where(ranges < max_range, ranges, np.nan), angles, index, float(index))


def tour(stops: Sequence[tuple[float, float]], step: float) -> Iterator[FloatArray]:
    """Yield poses (3,) every `step` [m] along `stops`, looking ahead; corners in steps of 20°."""
    heading = None
    for (x, y), (u, v) in pairwise(stops):
        ahead = float(np.arctan2(v - y, u - x))
        if heading is not None:
            turn = float(se2.wrap(ahead - heading))
            for share in np.arange(1, np.ceil(abs(turn) / 0.35)) / np.ceil(abs(turn) / 0.35):
                yield np.array([x, y, heading + share * turn])
        heading = ahead
        length = float(np.hypot(u - x, v - y))
        for done in np.arange(0, length, step):
            yield np.array([x + done * np.cos(ahead), y + done * np.sin(ahead), ahead])


def scans_along(
    outline: FloatArray,
    stops: Sequence[tuple[float, float]],
    seed: int,
    *,
    step: float = 0.35,
    first: int = 0,
) -> tuple[list[Scan], FloatArray]:
    """Return the noisy scans of a tour through `outline`, and their true (n, 3) poses."""
    rng = np.random.default_rng(seed)
    walls = walls_of(outline)
    poses = np.array(list(tour(stops, step)))
    scans = [
        cast(walls, pose, index=first + k, angles=AROUND[45:316:2], noise=rng)
        for k, pose in enumerate(poses)
    ]
    return scans, poses
