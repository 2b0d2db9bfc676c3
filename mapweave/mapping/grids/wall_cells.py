"""Walls held to the cells that they were read from: none where no cell is, no cell without one.

Scans err, so maps of scans take what lies close before or behind a wall for the same wall, and
bridge what they did not see. A grid's cells are where they are.
"""

from dataclasses import dataclass

import numpy as np
import scipy

from mapweave.geometry.arrays import BoolArray, FloatArray
from mapweave.geometry.segments import units
from mapweave.kernels.lines.evidence import take_greedily
from mapweave.kernels.lines.sampling import sample_parts
from mapweave.lines.sightings import Nearness

ACROSS = 2**0.5  # [cells] of a cell: what is farther from its middle is more than a cell off it
STATIONS = 4  # in a cell's length, at which a segment is judged
MIN_CELLS = 3  # that a wall must hold and no other does; fewer are a crumb


@dataclass(frozen=True, slots=True, eq=False)
class WallCells:
    """The occupied cells of a grid, and which of them are seen from free ones.

    Attributes
    ----------
    middles
        (n, 2) [m], frame of the grid's corner.
    seen
        (n,)
    resolution
        [m] of a cell.
    """

    middles: FloatArray
    seen: BoolArray
    resolution: float

    def near(self, segments: FloatArray) -> FloatArray:
        """Return the (k, 4) parts of (m, 4) `segments` [m] that are within a cell of these.

        Those as long as `MIN_CELLS` cells, or longer.
        """
        points, directions, length, owner = sample_parts(segments, self.resolution / STATIONS)
        apart, _ = scipy.spatial.KDTree(self.middles).query(points)
        near = np.flatnonzero(apart <= (ACROSS - 0.5 / STATIONS) * self.resolution)
        runs = np.split(near, 1 + np.flatnonzero((np.diff(near) > 1) | (np.diff(owner[near]) > 0)))
        first, last = (
            np.array([(run[0], run[-1]) for run in runs if len(run)], dtype=int).reshape(-1, 2).T
        )
        half = (length / 2)[:, None] * directions
        parts = np.column_stack([points[first] - half[first], points[last] + half[last]])
        _, lengths = units(parts)
        return np.asarray(parts[lengths >= MIN_CELLS * self.resolution - 1e-9])

    def missing(self, walls: FloatArray, sightings: FloatArray) -> FloatArray:
        """Return the fewest parts of `sightings` that hold seen cells which `walls` do not.

        Parameters
        ----------
        walls, sightings
            (m, 4) and (k, 4) [m]: a map, and what it was made from.

        Returns
        -------
        FloatArray
            (j, 4) [m], the one that holds most first.
        """
        left = self.seen.copy()
        left[self._pairs(walls, self.middles).sample] = False
        about = np.unique(self._pairs(sightings, self.middles[left]).segment)
        parts = self.near(sightings[about])
        pairs = self._pairs(parts, self.middles[left])
        holds = np.ones(len(pairs.sample), dtype=np.bool_)
        each = np.ones(np.count_nonzero(left))
        chosen = take_greedily(len(parts), pairs.segment, pairs.sample, holds, each, MIN_CELLS - 1)
        return parts[chosen]

    def _pairs(self, segments: FloatArray, middles: FloatArray) -> Nearness:
        """Pair `segments` (m, 4) with the cells that they are within a cell of."""
        no_direction = np.zeros_like(middles)
        return Nearness.of(segments, middles, no_direction, ACROSS * self.resolution)
