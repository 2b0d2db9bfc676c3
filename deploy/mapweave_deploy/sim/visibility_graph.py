"""Which walls are seen from where: how much of the world two tours have in common."""

import numpy as np
from scipy.spatial import KDTree

from mapweave.geometry.arrays import BoolArray, FloatArray, IntArray
from mapweave_deploy.sim.effects.rays import cast_rays
from mapweave_deploy.sim.world import World

PIECE = 0.25  # [m], walls are counted in pieces of this length
STEP = 1.0  # [m] between the places to look from
BEAMS = 240


class VisibilityGraph:
    """What is seen from a lattice of places in a world.

    Parameters
    ----------
    world
        The world.
    centres
        (n, 2) places where a robot can be [m]; a subset of them is looked from.
    sight
        Walls beyond are too far to count as seen [m].
    """

    def __init__(self, world: World, centres: FloatArray, sight: float) -> None:
        length = np.linalg.norm(world.walls[:, 2:] - world.walls[:, :2], axis=1)
        pieces = np.maximum(1, np.ceil(length / PIECE)).astype(np.int64)
        self._first = np.concatenate([[0], np.cumsum(pieces)])
        self.piece_length: FloatArray = np.repeat(length / pieces, pieces)
        cells = np.round(centres / STEP).astype(np.int64)
        places = centres[np.unique(cells, axis=0, return_index=True)[1]]
        self._tree = KDTree(places)
        self._seen = np.array([self._look(world, place, sight) for place in places])

    def _look(self, world: World, place: FloatArray, sight: float) -> BoolArray:
        """Return the (pieces,) of wall seen from `place` (2,)."""
        directions = np.linspace(-np.pi, np.pi, BEAMS)
        hits = cast_rays(world.walls, place, directions)
        near = hits.range < sight
        ends = place + hits.range[near, None] * np.column_stack(
            [np.cos(directions[near]), np.sin(directions[near])]
        )
        seen = np.zeros(self._first[-1], dtype=bool)
        seen[self._piece(world.walls, hits.wall[near], ends)] = True
        return seen

    def _piece(self, walls: FloatArray, wall: IntArray, ends: FloatArray) -> IntArray:
        """Return which piece of which wall each of `ends` (k, 2) lies on."""
        start, along = walls[wall, :2], walls[wall, 2:] - walls[wall, :2]
        share = np.sum((ends - start) * along, axis=1) / np.sum(along * along, axis=1)
        count = np.diff(self._first)[wall]
        within = np.clip(share * count, 0, count - 1).astype(np.int64)
        return np.asarray(self._first[wall] + within)

    def along(self, path: FloatArray) -> BoolArray:
        """Return the (pieces,) of wall seen on the way along `path` (k, 2) [m]."""
        _, places = self._tree.query(path)
        return np.asarray(np.any(self._seen[np.unique(places)], axis=0))

    def metres(self, seen: BoolArray) -> float:
        """Return how much wall `seen` (pieces,) is [m]."""
        return float(np.sum(self.piece_length[seen]))
