"""The built-in rescue arena, 12 × 12 m: short oblique walls, dead ends and rubble.

It is modelled on the yellow arena of the RoboCup Rescue competition, which the paper maps
(figure 1a). The seed places everything but the outer fence.
"""

import numpy as np
import shapely
from numpy.random import Generator
from shapely.geometry.base import BaseGeometry

from mapweave.geometry.arrays import FloatArray
from mapweave_deploy.sim.world import World, box, make_world

SIZE = 12.0
PANEL = 0.06  # thickness of the plywood [m]
PASSAGE = 0.75  # between two solids [m]
ATTEMPTS = {"dead end": 6, "wall": 40, "rubble": 70}  # what would block a passage is left out

# Corners cut off unequally, so that the fence does not look alike from two sides.
FENCE = shapely.Polygon(
    [(0.2, 0.2), (8.9, 0.2), (11.8, 1.9), (11.8, 11.8), (4.4, 11.8), (2.9, 10.6), (0.2, 10.9)]
)


def arena(seed: int) -> World:
    """Return the arena that `seed` builds."""
    rng = np.random.default_rng(seed)
    solids: list[BaseGeometry] = []
    for make, kind in ((_dead_end, "dead end"), (_wall, "wall"), (_rubble, "rubble")):
        for _ in range(ATTEMPTS[kind]):
            solid = make(rng)
            # Either a robot fits between, or there is nothing to pass.
            if not any(0 < solid.distance(other) <= PASSAGE for other in solids):
                solids.append(solid)
    free = FENCE.difference(shapely.union_all(solids))
    return make_world("arena", free, shapely.Polygon(), _stops(rng))


def _somewhere(rng: Generator) -> tuple[float, float, float]:
    """Return a place and a direction anywhere in the arena; walls mostly near a right angle."""
    x, y = rng.uniform(0.0, SIZE, size=2)
    return x, y, rng.choice([0.0, np.pi / 2]) + rng.normal(0.0, 0.35)


def _wall(rng: Generator) -> BaseGeometry:
    """Return a panel, some of them bent."""
    x, y, turn = _somewhere(rng)
    length, bend = rng.uniform(0.9, 2.0), rng.uniform(-1.3, 1.3)
    return _panels(x, y, [(length, turn), (rng.uniform(0.5, 1.4), turn + bend)])


def _dead_end(rng: Generator) -> BaseGeometry:
    """Return three panels around a bay that is open at one side."""
    x, y, turn = _somewhere(rng)
    depth, width = rng.uniform(1.4, 2.0), rng.uniform(1.5, 2.0)
    skew = rng.uniform(-0.3, 0.3)
    steps = [(depth, turn), (width, turn + np.pi / 2 + skew), (depth * 0.8, turn + np.pi)]
    return _panels(x, y, steps)


def _panels(x: float, y: float, steps: list[tuple[float, float]]) -> BaseGeometry:
    """Return panels end to end from (`x`, `y`), each with its length [m] and direction [rad]."""
    corners = [np.array([x, y])]
    for length, turn in steps:
        corners.append(corners[-1] + length * np.array([np.cos(turn), np.sin(turn)]))
    return shapely.LineString(corners).buffer(PANEL / 2, cap_style="flat", join_style="mitre")


def _rubble(rng: Generator) -> BaseGeometry:
    """Return a brick, or a few heaped on each other."""
    x, y, _ = _somewhere(rng)
    return shapely.union_all([_brick(x, y, rng) for _ in range(int(rng.integers(1, 4)))])


def _brick(x: float, y: float, rng: Generator) -> BaseGeometry:
    """Return a brick of any size and turn near (`x`, `y`)."""
    shift_x, shift_y = rng.normal(0.0, 0.12, size=2)
    width, depth = rng.uniform(0.15, 0.45, size=2)
    return box(x + shift_x, y + shift_y, width, depth, rng.uniform(0.0, np.pi))


def _stops(rng: Generator) -> FloatArray:
    """Return a jittered lattice of places to look at."""
    lattice = np.stack(np.meshgrid(*[np.arange(1.2, SIZE, 2.0)] * 2), axis=-1).reshape(-1, 2)
    return lattice + rng.uniform(-0.4, 0.4, size=lattice.shape)
