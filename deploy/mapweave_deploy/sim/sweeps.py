"""All that a lidar measures on a tour: the place, the people in it, the robot itself."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.random import Generator
from pydantic import BaseModel, ConfigDict

from mapweave.geometry.arrays import FloatArray
from mapweave_deploy.sim.effects.doors import DoorParameters, doors_at
from mapweave_deploy.sim.lidar import LidarParameters, measure
from mapweave_deploy.sim.own_body import OwnBodyParameters, body_ranges, in_view
from mapweave_deploy.sim.people import PeopleParameters, people_at
from mapweave_deploy.sim.trajectories import Tour
from mapweave_deploy.sim.world import World

NO_FACES = np.empty((0, 4))


class SweepParameters(BaseModel):
    """The lidar, and what gets into its way."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    lidar: LidarParameters = LidarParameters()
    people: PeopleParameters = PeopleParameters()
    body: OwnBodyParameters = OwnBodyParameters()
    doors: DoorParameters | None = None  # all doors are out


def sweeps(
    world: World, tour: Tour, parameters: SweepParameters, rng: Generator, others: Generator
) -> Iterator[FloatArray]:
    """Yield the ranges (beams,) [m] of each scan of a tour; the maximum: nothing came back.

    Parameters
    ----------
    rng, others
        Of the readings, and of all that is in their way: with or without it they err alike.
    """
    p = parameters
    faces = people_at(world, tour, p.people, others)
    body = body_ranges(p.lidar.angles, p.body, others)
    shown = in_view(len(tour.stamp), p.body, others)
    leaves = doors_at(world, tour, p.doors, others) if p.doors else [NO_FACES] * len(tour.stamp)
    for pose, people, doors, seen in zip(tour.pose, faces, leaves, shown, strict=True):
        there = np.vstack([people, doors])
        walls, dark = np.vstack([world.walls, there]), np.zeros(len(there), dtype=np.bool_)
        crowded = replace(world, walls=walls, dark=np.concatenate([world.dark, dark]))
        ranges = measure(crowded, pose, p.lidar, rng)
        own = body + others.normal(0.0, p.body.noise, len(body))
        yield np.minimum(ranges, own) if seen else ranges
