"""Twin rooms: two that are built alike, on the two sides of a corridor, half a turn apart."""

import numpy as np
import shapely
import shapely.affinity

from mapweave_deploy.sim.world import World, box, make_world

LENGTH, WIDTH = 26.0, 2.2  # [m] of the corridor


def twin_rooms(seed: int) -> World:
    """Return the corridor, the twins, and two rooms that are unlike."""
    rng = np.random.default_rng(seed)
    wide, deep = rng.uniform(4.5, 6.0), rng.uniform(5.0, 6.5)
    room = shapely.box(0, -deep, wide, 0)
    closet = box(rng.uniform(0.4, 0.8) * wide, -deep + 0.3, rng.uniform(0.8, 1.4), 0.6)
    door = shapely.box(0.5, -0.05, 1.5, 0.2)
    twin = shapely.union_all([room.difference(closet), door])
    left, right = rng.uniform(2.5, 4.0), LENGTH - rng.uniform(2.5, 4.0)
    below = shapely.affinity.translate(twin, left, -0.15)
    turned = shapely.affinity.rotate(twin, 180.0, origin=(0.0, 0.0))
    above = shapely.affinity.translate(turned, right, WIDTH + 0.15)
    others = [
        box(LENGTH - 4, -1.3, rng.uniform(2.5, 4), 2.8),
        box(5, WIDTH + 1.9, rng.uniform(3, 5), 4),
    ]
    corridor = shapely.box(0, 0, LENGTH, WIDTH)
    free = shapely.union_all([corridor, below, above, *others])
    middle = wide / 2, deep / 2
    stops = [
        (left + middle[0], -middle[1]), (right - middle[0], WIDTH + middle[1]),
        *((x, WIDTH / 2) for x in (1.5, 8.0, 13.0, 19.0, LENGTH - 1.5)),
        (LENGTH - 4, -1.3), (5.0, WIDTH + 2.0),
    ]  # fmt: skip
    return make_world("twins", free, shapely.Polygon(), np.array(stops))
