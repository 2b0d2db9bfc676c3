"""Where a robot fits, as a grid, and the shortest ways through it."""

from dataclasses import dataclass

import numpy as np
import shapely
from scipy import ndimage, sparse
from scipy.sparse import csgraph

from mapweave.geometry.arrays import BoolArray, FloatArray, IntArray
from mapweave_deploy.sim.world import World

CELL = 0.1  # [m]
COMFORT = 0.6  # [m], nearer to a wall than this a way costs more, so that it keeps to the middle
DISCOMFORT = 3.0  # how much more it costs at the wall


@dataclass(frozen=True, slots=True, eq=False)
class Grid:
    """The cells of a world where a robot fits, as a graph.

    Attributes
    ----------
    centres
        (n, 2) of the cells in the world's frame [m].
    costs
        (n, n) sparse: metres from cell to neighbouring cell, more near walls.
    """

    centres: FloatArray
    costs: sparse.csr_array

    def nearest(self, points: FloatArray) -> IntArray:
        """Return the (k,) cells nearest to `points` (k, 2)."""
        away = np.linalg.norm(self.centres[None] - points[:, None], axis=-1)
        return np.asarray(np.argmin(away, axis=1), dtype=np.int64)

    def ways_from(self, cells: IntArray) -> tuple[FloatArray, IntArray]:
        """Return from each of k `cells` to all the (k, n) costs, and the (k, n) cells before."""
        costs, before = csgraph.dijkstra(self.costs, indices=cells, return_predecessors=True)
        return costs, np.asarray(before, dtype=np.int64)


def make_grid(world: World, radius: float) -> Grid:
    """Return the largest connected part of `world` where a robot of `radius` [m] fits."""
    west, south, east, north = world.free.bounds
    x, y = np.meshgrid(np.arange(west, east, CELL), np.arange(south, north, CELL))
    clearance = shapely.distance(shapely.points(x, y), world.free.boundary)
    fits = shapely.contains_xy(world.free, x, y) & (clearance >= radius)
    fits = _largest_part(fits)
    costs = _neighbour_costs(fits, 1.0 + DISCOMFORT * np.maximum(0.0, 1.0 - clearance / COMFORT))
    return Grid(np.column_stack([x[fits], y[fits]]), costs)


def _largest_part(fits: BoolArray) -> BoolArray:
    """Return the largest 4-connected part of `fits`."""
    labels, _ = ndimage.label(fits)
    sizes = np.bincount(labels.ravel())
    sizes[0] = 0
    return np.asarray(labels == np.argmax(sizes))


def _neighbour_costs(fits: BoolArray, weight: FloatArray) -> sparse.csr_array:
    """Return the (n, n) costs between 8-neighbours among the n cells of `fits`."""
    number = np.full(fits.shape, -1)
    number[fits] = np.arange(np.count_nonzero(fits))
    rows, columns, costs = [], [], []
    for down, right in ((0, 1), (1, 0), (1, 1), (1, -1)):
        here = np.argwhere(fits)
        there = here + np.array([down, right])
        inside = np.all((there >= 0) & (there < fits.shape), axis=1)
        here, there = here[inside], there[inside]
        both = fits[there[:, 0], there[:, 1]]
        a, b = tuple(here[both].T), tuple(there[both].T)
        rows.append(number[a])
        columns.append(number[b])
        costs.append(CELL * np.hypot(down, right) * (weight[a] + weight[b]) / 2)
    entries = (np.concatenate(costs), (np.concatenate(rows), np.concatenate(columns)))
    count = int(np.count_nonzero(fits))
    half = sparse.csr_array(entries, shape=(count, count))
    return sparse.csr_array(half + half.T)
