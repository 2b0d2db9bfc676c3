"""Makes the logs of a simulated team: each robot's scans in one file, the truth in another.

A log is an ordinary CARMEN log of ``ROBOTLASER1`` lines whose pose fields are all zero, so that a
robot's process is the same for a simulated and for a real log, and the truth cannot leak into it.
"""

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mapweave.errors import MapweaveError
from mapweave.geometry.arrays import FloatArray
from mapweave_deploy.sim.lidar import LidarParameters
from mapweave_deploy.sim.lidars import LIDARS
from mapweave_deploy.sim.settings import SETTINGS, Setting
from mapweave_deploy.sim.sweeps import SweepParameters, sweeps
from mapweave_deploy.sim.trajectories import Tour, plan_tours
from mapweave_deploy.sim.world import World

TRUTH_FORMAT = "mapweave/truth/1"


@dataclass(frozen=True, slots=True, eq=False)
class RobotLog:
    """What the simulation wrote for one robot.

    Attributes
    ----------
    robot
        Its id: r1, r2, …
    log, truth
        The two files.
    tour
        The truth: when and from where each scan was taken.
    """

    robot: str
    log: Path
    truth: Path
    tour: Tour


def simulate(
    world: str = "office",
    robots: int = 2,
    seed: int = 1,
    folder: str | Path = "logs",
    lidar: str | None = None,
) -> list[RobotLog]:
    """Write ``r1.log``, ``r1-truth.json``, … into `folder`; the same seed gives the same bytes.

    Parameters
    ----------
    world
        Such as ``office`` or ``arena``: what there is, and what is hard in it, tells ``mapweave
        team --help``.
    robots
        How many, each with a tour of its own.
    seed
        Of the world, the tours and the noise.
    folder
        Made where it is missing.
    lidar
        Of all robots, such as ``rplidar``; by default that of the world.

    Returns
    -------
    list of RobotLog
        One a robot.

    Raises
    ------
    MapweaveError
        If there is no such world or lidar.
    """
    setting = _setting(world, lidar)
    ground, places = setting.places(seed, robots)
    tours = plan_tours(ground, robots, setting.tours, np.random.default_rng([seed, robots]))
    target = Path(folder)
    target.mkdir(parents=True, exist_ok=True)
    logs = []
    for number, (place, tour) in enumerate(zip(places, tours, strict=True), start=1):
        robot = f"r{number}"
        log = RobotLog(robot, target / f"{robot}.log", target / f"{robot}-truth.json", tour)
        log.log.write_text(_measured(place, tour, setting.sweeps, seed, number), encoding="ascii")
        log.truth.write_text(_truth(place.name, seed, log), encoding="ascii")
        logs.append(log)
    return logs


def _setting(world: str, lidar: str | None) -> Setting:
    """Return the built-in world of that name, with the lidar of that name, if one is given."""
    if world not in SETTINGS:
        raise MapweaveError(f"no world {world!r}; there are {', '.join(SETTINGS)}")
    if lidar is None:
        return SETTINGS[world]
    if lidar not in LIDARS:
        raise MapweaveError(f"no lidar {lidar!r}; there are {', '.join(LIDARS)}")
    return SETTINGS[world].with_lidar(LIDARS[lidar])


def _measured(place: World, tour: Tour, around: SweepParameters, seed: int, number: int) -> str:
    """Return the lines of the log of robot `number`."""
    rng, others = (np.random.default_rng([seed, number, part]) for part in (1, 2))
    measured = sweeps(place, tour, around, rng, others)
    return "".join(
        scan_line(ranges, float(stamp), around.lidar)
        for ranges, stamp in zip(measured, tour.stamp, strict=True)
    )


def scan_line(ranges: FloatArray, stamp: float, lidar: LidarParameters) -> str:
    """Return a ``ROBOTLASER1`` line of `ranges` (n,) [m] taken at `stamp` [s]; all poses zero.

    The fields, after CARMEN's logger: laser type, start angle, field of view, resolution, maximum
    range, accuracy, remission mode; n and the ranges; the number of remissions; laser pose, robot
    pose, tv, rv, two safety distances, turn axis; time stamp, host, logger's time stamp.
    """
    n, clockwise = lidar.beams, lidar.order == "clockwise"
    first, step = -lidar.field_of_view / 2, lidar.field_of_view / (n - 1)
    if clockwise:
        first, step = -first, -step
    head = (
        f"ROBOTLASER1 0 {first:.6f} {lidar.field_of_view:.6f}"
        f" {step:.8f} {lidar.maximum_range:.2f} {lidar.noise:.3f} 0"
    )
    told = ranges if lidar.order == "counter-clockwise" else ranges[::-1]
    readings = " ".join(f"{reading:.3f}" for reading in told)
    zeros = " ".join(["0"] * 11)
    return f"{head} {n} {readings} 0 {zeros} {stamp:.6f} simulated {stamp:.6f}\n"


def _truth(world: str, seed: int, log: RobotLog) -> str:
    """Return the truth file: for each scan of the log its index and pose in the world."""
    poses = [
        [index, *(round(float(value), 6) for value in pose)]
        for index, pose in enumerate(log.tour.pose)
    ]
    content = {"format": TRUTH_FORMAT, "world": world, "seed": seed, "robot": log.robot}
    return json.dumps(content | {"poses": poses}) + "\n"
