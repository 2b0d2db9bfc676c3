"""Tours: where each robot of a team drives, partly through the same rooms.

Candidate tours are drawn at random; of them those are taken that together see most of the world
while each pair sees enough of the same walls to be joined.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import shapely
from numpy.random import Generator
from pydantic import BaseModel, ConfigDict, Field
from scipy import ndimage

from mapweave.geometry.arrays import BoolArray, FloatArray, IntArray
from mapweave_deploy.sim.grid import Grid, make_grid
from mapweave_deploy.sim.visibility_graph import VisibilityGraph
from mapweave_deploy.sim.world import World

STEP = 0.05  # [m] between the points of a path


class TourParameters(BaseModel):
    """How robots drive. Defaults: a small indoor robot, about a TurtleBot."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    radius: float = Field(0.28, gt=0)  # [m], kept between the robot's middle and any wall
    speed: float = Field(0.4, gt=0)  # [m/s]
    turn_rate: float = Field(np.radians(40.0), gt=0)  # [rad/s]
    scan_rate: float = Field(4.0, gt=0)  # [1/s]; with 0.4 m/s a scan every 0.1 m
    length: float = Field(45.0, gt=0)  # [m]
    shared_wall: float = Field(35.0, ge=0)  # [m] each pair should see in common, if it can be had
    candidates: int = Field(40, ge=1)  # drawn for each robot
    sight: float = Field(8.0, gt=0)  # [m], walls beyond are too far to count as seen


@dataclass(frozen=True, slots=True, eq=False)
class Tour:
    """A drive.

    Attributes
    ----------
    stamp
        (m,) when each scan is taken, from 0 [s].
    pose
        (m, 3) where, in the world's frame [m, m, rad].
    """

    stamp: FloatArray
    pose: FloatArray


def plan_tours(world: World, robots: int, parameters: TourParameters, rng: Generator) -> list[Tour]:
    """Return a tour for each of `robots` robots, each pair's overlapping."""
    grid = make_grid(world, parameters.radius)
    stops = grid.nearest(world.stops)
    costs, before = grid.ways_from(stops)
    paths = []
    for _ in range(parameters.candidates * robots):
        order = _random_order(costs[:, stops], parameters.length, rng)
        paths.append(_path(grid, before, stops, order, parameters.length))
    visibility = VisibilityGraph(world, grid.centres, parameters.sight)
    seen = np.array([visibility.along(path) for path in paths])
    chosen = _choose(seen, visibility.piece_length, robots, parameters.shared_wall)
    return [drive(_smooth(world, paths[k], parameters.radius), parameters) for k in chosen]


def tour_through(world: World, stops: FloatArray, parameters: TourParameters) -> Tour:
    """Return the tour to (k, 2) `stops` [m] in their order, each as near as the robot fits."""
    grid = make_grid(world, parameters.radius)
    cells = grid.nearest(stops)
    _, before = grid.ways_from(cells)
    path = _path(grid, before, cells, list(range(len(cells))), np.inf)
    return drive(_smooth(world, path, parameters.radius), parameters)


def _random_order(costs: FloatArray, length: float, rng: Generator) -> list[int]:
    """Return stops to visit one after the other, each a near one not visited yet.

    `costs` (k, k) is the cost of the way from stop to stop, at least its length [m].
    """
    order, cost = [int(rng.integers(len(costs)))], 0.0
    while len(order) < len(costs) and cost < 3 * length:  # ways cost up to a few times their length
        away = costs[order[-1]].copy()
        away[order] = np.inf
        order.append(int(rng.choice(np.argsort(away)[:3])))
        cost += float(costs[order[-2], order[-1]])
    return order


def _path(
    grid: Grid, before: IntArray, stops: IntArray, order: list[int], length: float
) -> FloatArray:
    """Return the (k, 2) points [m] of the way through the stops of `order`, `length` [m] of it."""
    legs = [grid.centres[_walk(before[start], int(stops[end]))] for start, end in pairwise(order)]
    return _evenly(np.concatenate(legs), length)


def _walk(before: IntArray, end: int) -> list[int]:
    """Return the cells on the way to cell `end`, `before` (n,) naming the one before each."""
    cells = [end]
    while before[cells[-1]] >= 0:
        cells.append(int(before[cells[-1]]))
    return cells[::-1]


def _evenly(path: FloatArray, length: float) -> FloatArray:
    """Return the first `length` [m] of `path` (k, 2) as points `STEP` apart."""
    steps = np.linalg.norm(np.diff(path, axis=0), axis=1)
    path = path[np.concatenate([[True], steps > 0])]
    along = np.concatenate([[0.0], np.cumsum(steps[steps > 0])])
    at = np.arange(0.0, min(length, along[-1]), STEP)
    return np.column_stack([np.interp(at, along, path[:, axis]) for axis in (0, 1)])


def _choose(seen: BoolArray, piece_length: FloatArray, count: int, shared: float) -> list[int]:
    """Return the `count` rows of `seen` (tours, pieces) that see most, `shared` [m] in common.

    One after the other: the one that adds most among those that share enough with every one
    chosen before; where none does, the one whose smallest share is largest.
    """
    weighted = seen * piece_length
    common = weighted @ seen.T.astype(float)
    chosen = [int(np.argmax(np.sum(weighted, axis=1)))]
    while len(chosen) < count:
        least = np.min(common[:, chosen], axis=1)
        least[chosen] = -np.inf
        new = np.sum(weighted[:, ~np.any(seen[chosen], axis=0)], axis=1)
        enough = least >= shared
        scores = np.where(enough, new, -np.inf) if np.any(enough) else least
        chosen.append(int(np.argmax(scores)))
    return chosen


def _smooth(world: World, path: FloatArray, radius: float) -> FloatArray:
    """Return `path` (k, 2) as smooth as it can be without touching a wall."""
    for width in (0.5, 0.35, 0.25, 0.15, 0.1, 0.05):  # [m]
        smooth = ndimage.gaussian_filter1d(path, width / STEP, axis=0, mode="nearest")
        # A cell's diagonal cuts corners by up to a few centimetres.
        if world.free.boundary.distance(shapely.LineString(smooth)) > radius - 0.05:
            return smooth
    return path


def drive(path: FloatArray, parameters: TourParameters) -> Tour:
    """Return the tour along `path` (k, 2): as fast as the bounds on speed and turning allow."""
    steps = np.diff(path, axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    moving = lengths > 1e-6
    heading = np.unwrap(np.arctan2(steps[moving, 1], steps[moving, 0]))
    points = path[:-1][moving]
    seconds = np.maximum(
        np.linalg.norm(np.diff(points, axis=0), axis=1) / parameters.speed,
        np.abs(np.diff(heading)) / parameters.turn_rate,
    )
    at = np.concatenate([[0.0], np.cumsum(seconds)])
    stamp = np.arange(0.0, at[-1], 1.0 / parameters.scan_rate)
    columns = (points[:, 0], points[:, 1], heading)
    return Tour(stamp, np.column_stack([np.interp(stamp, at, column) for column in columns]))
