"""Logs of one drive, as different programs and sensors write them."""

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

from mapweave.geometry.arrays import FloatArray
from tests.mapweave.buildings import BUILDING, cast, walls_of

NO_TIMES, TIMES = "", " {stamp:.2f} host {stamp:.2f}"


class Sensor(NamedTuple):
    """A laser: where its first beam looks, and from each to the next [°]; how many there are."""

    start: float
    step: float
    beams: int

    @property
    def angles(self) -> FloatArray:
        """(n,) [rad] in the order of its readings."""
        angles: FloatArray = np.radians(self.start + self.step * np.arange(self.beams))
        return angles


def drive() -> FloatArray:
    """Return the (n, 3) poses of a short drive that turns to one side."""
    share = np.linspace(0, 1, 12)
    x, heading = 3 + 3 * share, 0.5 * share
    return np.column_stack([x, np.full(len(x), 1.0), heading])


def readings(sensor: Sensor, seed: int = 5) -> Iterator[tuple[float, str]]:
    """Yield the stamp [s] and the readings of each scan of the drive, in the sensor's order."""
    rng, turned = np.random.default_rng(seed), sensor.step < 0
    angles = sensor.angles[::-1] if turned else sensor.angles
    for k, pose in enumerate(drive()):
        ranges = cast(walls_of(BUILDING), pose, angles=angles, noise=rng, max_range=20.0).ranges
        ordered = np.nan_to_num(ranges[::-1] if turned else ranges, nan=0.0)
        yield 0.5 * k, " ".join(f"{value:.3f}" for value in ordered)


def robotlaser(sensor: Sensor, unit: Callable[[float], float] = np.radians) -> str:
    """Return a log of ``ROBOTLASER1``; `unit` takes degrees to what the log has."""
    field = abs(sensor.step) * (sensor.beams - 1)
    head = (
        f"ROBOTLASER1 0 {unit(sensor.start):.8f} {unit(field):.8f} {unit(sensor.step):.10f} 30 0 0"
    )
    return "".join(
        f"{head} {sensor.beams} {text} 0 0 0 0 0 0 0 0 0 0 0 0 {stamp:.2f} host {stamp:.2f}\n"
        for stamp, text in readings(sensor)
    )


def flaser(sensor: Sensor, head: str = "", times: str = TIMES) -> str:
    """Return a log of ``FLASER``, after `head`, each line with `times` at its end."""
    return head + "".join(
        f"FLASER {sensor.beams} {text} 0 0 0 0 0 0" + times.format(stamp=stamp) + "\n"
        for stamp, text in readings(sensor)
    )


def player(sensor: Sensor, pose: bool = False) -> str:
    """Return a log of Player's ``laser``, with odometry between; with a `pose` of the robot."""
    low, step = np.radians([sensor.start, sensor.step])
    high = low + step * (sensor.beams - 1)
    where, kind = (" 1 2 0.5", "002") if pose else ("", "001")
    lines = ["## Player version 2.0.5\n"]
    for k, (stamp, text) in enumerate(readings(sensor)):
        pairs = " ".join(f"{reading} 0" for reading in text.split())
        device = f"{stamp:014.3f} 16777343 6665"
        lines.append(f"{device} position2d 00 001 001 0.1 0.2 0.3 0 0 0 0\n")
        head = f"{device} laser 00 001 {kind} {k}{where} {low:.6f} {high:.6f} {step:.8f} 30.0"
        lines.append(f"{head} {sensor.beams} {pairs}\n")
    return "".join(lines)


def dpslam(sensor: Sensor) -> str:
    """Return a log as DP-SLAM writes them: where the odometry was before each scan, no times."""
    return "".join(
        f"Odometry {k / 4} -0.5 0.25\nLaser {sensor.beams} {text} \n"
        for k, (_, text) in enumerate(readings(sensor))
    )
