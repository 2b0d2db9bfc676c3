"""Offices with glass walls, and a gallery with mirrors."""

from itertools import pairwise

import numpy as np
import shapely
from numpy.random import Generator

from mapweave.geometry.arrays import FloatArray
from mapweave_deploy.sim.world import World, box, make_world, paned

NOTHING = shapely.Polygon()
PANE = 0.05  # [m] thick
LENGTH, WIDTH, DEEP = 18.0, 2.0, 4.5  # [m] of the corridor, and how deep the rooms are


def glass_house(seed: int) -> World:
    """Return rooms along a corridor, behind walls of glass with doors in them."""
    rng = np.random.default_rng(seed)
    plan, panes = _rooms(rng)
    free = plan.difference(shapely.union_all(panes))
    world = make_world("glass", free, NOTHING, _stops())
    return paned(world, shapely.union_all(panes).buffer(PANE), NOTHING)


def gallery(seed: int) -> World:
    """Return the same rooms open to the corridor, and mirrors on some of their walls."""
    rng = np.random.default_rng(seed)
    plan, _ = _rooms(rng)
    back = WIDTH + DEEP
    mirrors = [
        shapely.box(x, y - PANE, x + width, y + PANE)
        for x, y, width in ((1.0, back, 2.5), (7.5, back, 3.0), (14.0, 0.0, 2.0))
    ]
    # Set into their walls, so that a mirror's face is a face of its own.
    niches = shapely.union_all([m.buffer(-0.01) for m in mirrors])
    world = make_world("mirrors", plan.union(niches), NOTHING, _stops())
    return paned(world, NOTHING, shapely.union_all(mirrors))


def _rooms(rng: Generator) -> tuple[shapely.Polygon, list[shapely.Polygon]]:
    """Return corridor and rooms, and the panes that keep them apart but for their doors."""
    walls = np.sort(np.array([6.0, 12.0]) + rng.uniform(-0.8, 0.8, 2))
    edges = [0.0, *walls, LENGTH]
    plan = shapely.box(0, 0, LENGTH, WIDTH + DEEP)
    parts = [box(x, WIDTH + DEEP / 2, 0.15, DEEP) for x in walls]
    things = [
        box(rng.uniform(a + 1.2, b - 1.2), rng.uniform(4.2, 5.6), *rng.uniform(0.4, 1.2, 2))
        for a, b in pairwise(edges)
    ]
    nook = box(LENGTH, rng.uniform(0.8, 1.2), 1.6, 1.0)
    free = plan.difference(shapely.union_all([*parts, *things])).union(nook)
    panes = []
    for a, b in pairwise(edges):
        door = rng.uniform(a + 0.4, b - 1.6)
        panes += [
            shapely.box(low, WIDTH, high, WIDTH + PANE)
            for low, high in ((a, door), (door + 1.1, b))
        ]
    return free, panes


def _stops() -> FloatArray:
    middles = [(x, WIDTH + 1.2) for x in (2.5, 9.0, 15.5)]
    return np.array([*middles, *((x, WIDTH / 2) for x in (1.2, 5.0, 9.0, 13.0, 16.8))])
