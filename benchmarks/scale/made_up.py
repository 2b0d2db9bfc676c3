"""Buildings made up, and the maps of robots in them: they fill up what recordings leave open."""

import numpy as np
import shapely

from benchmarks.floor_plans import plan_of, row_of_rooms, seen_in
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.maps import RobotMap, Submap, Trajectory

ROOMS = 14  # along the corridor of a building
SIDE, STEP = 13.0, 7.0  # [m] of the part that a submap shows, and from one to the next
SUBMAPS = 8  # of a robot


def robots_of(seed: int, count: int) -> tuple[list[RobotMap], FloatArray]:
    """Return the maps of `count` robots in one building, and (count, 3) their frames in it.

    A robot's submaps follow each other along the corridor from a place of its own, there and back.
    """
    rng = np.random.default_rng([16, seed])
    rooms = row_of_rooms(rng, ROOMS)
    plan, length = plan_of(rooms), rooms[-1].right
    maps, frames = [], []
    for k in range(count):
        start = rng.uniform(0.0, length)
        along = np.abs((start + STEP * np.arange(SUBMAPS)) % (2 * length) - length)
        motion = np.array([*rng.uniform(-30, 30, 2), rng.uniform(-np.pi, np.pi)])
        boxes = [shapely.box(x - SIDE / 2, -20, x + SIDE / 2, 20) for x in along]
        submaps = tuple(
            Submap(j, 0, np.zeros(3), seen_in(plan, box, rng).moved(motion), Trajectory.empty())
            for j, box in enumerate(boxes)
        )
        maps.append(RobotMap(f"m{seed}-{k}", "boot", 1, submaps))
        frames.append(se2.inverse(motion))
    return maps, np.array(frames)
