"""Halls with little in them: bare ones, colonnades, round rooms."""

import numpy as np
import shapely
from numpy.random import Generator
from shapely.geometry.base import BaseGeometry

from mapweave.geometry.arrays import FloatArray
from mapweave_deploy.sim.world import World, box, make_world

NOTHING = shapely.Polygon()
CORNERS = 72  # of a round room: 5° each


def hall(seed: int) -> World:
    """Return a bare hall of 14 to 20 m with two bays: a lidar of short range sees nothing in it."""
    rng = np.random.default_rng(seed)
    width, depth = rng.uniform(14, 20), rng.uniform(9, 14)
    bays = [
        box(rng.uniform(3, width - 3), depth, rng.uniform(1.2, 3), rng.uniform(1, 2.4)),
        box(width, rng.uniform(3, depth - 3), rng.uniform(0.8, 1.6), rng.uniform(1.2, 3)),
    ]
    free = shapely.union_all([shapely.box(0, 0, width, depth), *bays])
    return make_world("hall", free, NOTHING, _lattice(width, depth, rng))


def colonnade(seed: int) -> World:
    """Return a nave of 24 m between two rows of pillars that all look alike."""
    rng = np.random.default_rng(seed)
    pitch, aside, side = rng.uniform(0.9, 1.5), rng.uniform(1.4, 2.0), rng.uniform(0.25, 0.4)
    nave = shapely.box(0, -aside - 1.6, 24, aside + 1.6)
    apse = box(24, rng.uniform(-0.6, 0.6), 2.4, 1.8)
    pillars = [box(x, y, side, side) for x in np.arange(1.5, 23, pitch) for y in (-aside, aside)]
    free = shapely.union_all([nave, apse]).difference(shapely.union_all(pillars))
    stops = np.column_stack([np.linspace(1, 23, 12), rng.uniform(-0.5, 0.5, 12)])
    return make_world("colonnade", free, NOTHING, stops)


def round_rooms(seed: int) -> World:
    """Return two round rooms of other sizes, and a corridor between their doors."""
    rng = np.random.default_rng(seed)
    first, second = rng.uniform(2.6, 3.4), rng.uniform(3.8, 4.8)
    length = rng.uniform(4, 6)
    far = first + length + second
    lobby = shapely.box(0.9 * first, -0.9, far - 0.9 * second, 0.9)
    niche = box(first + length * rng.uniform(0.3, 0.7), 0.9, 1.4, 1.2)
    free = shapely.union_all([_round(0.0, first), _round(far, second), lobby, niche])
    around = [(0.0, 0.0), (first + length / 2, 0.0), (far, 0.0)]
    away = [(0.5 * first, 0.6), (-0.4 * first, -0.5), (far + 0.5 * second, 1.0)]
    return make_world("round", free, NOTHING, np.array([*around, *away]))


def _round(x: float, radius: float) -> BaseGeometry:
    turns = np.arange(CORNERS) * (2 * np.pi / CORNERS)
    return shapely.Polygon(np.column_stack([x + radius * np.cos(turns), radius * np.sin(turns)]))


def _lattice(width: float, depth: float, rng: Generator) -> FloatArray:
    """Return jittered places to look at, 3 m apart."""
    x, y = np.meshgrid(np.arange(1.5, width, 3.0), np.arange(1.5, depth, 3.0))
    points = np.column_stack([x.ravel(), y.ravel()])
    return points + rng.uniform(-0.4, 0.4, points.shape)
