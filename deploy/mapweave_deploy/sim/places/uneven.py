"""A hall on two levels: a ramp, and sills before its rooms."""

from dataclasses import replace

import numpy as np
import shapely

from mapweave_deploy.sim.effects.terrain import Ramp, Terrain, sill
from mapweave_deploy.sim.world import World, box, make_world


def ramps(seed: int) -> World:
    """Return two halls, one half a metre above the other, and the ramp that leads there."""
    rng = np.random.default_rng(seed)
    low = shapely.box(0, 0, 9, rng.uniform(6, 8))
    ramp = shapely.box(8.9, 2.0, 15.1, 4.0)
    high = shapely.box(15, 0, 23, rng.uniform(5, 7))
    rooms = [box(3.0, -1.6, rng.uniform(2.5, 4), 3.0), box(19.0, -1.4, rng.uniform(3, 4), 2.6)]
    x, y = rng.uniform([5, 4.2], [7, 5.2]).tolist()
    things = [box(x, y, 0.8, 0.5), box(20.5, 3.4, rng.uniform(0.4, 1.0), rng.uniform(0.4, 1.0))]
    free = shapely.union_all([low, ramp, high, *rooms]).difference(shapely.union_all(things))
    stops = [
        (2.0, 2.0),
        (6.5, 3.0),
        (3.0, -1.4),
        (12.0, 3.0),
        (17.0, 3.0),
        (19.0, -1.2),
        (21.8, 2.0),
    ]
    world = make_world("ramps", free, shapely.Polygon(), np.array(stops))
    slope = Ramp((9.0, 3.0), (15.0, 3.0), rng.uniform(0.4, 0.6))
    floor = (slope, *sill(3.0, 0.0, -np.pi / 2), *sill(19.0, 0.0, -np.pi / 2))
    return replace(world, terrain=Terrain(floor))
