"""Lidars of all kinds in one simulated office: each maps it about as well as a plain one does.

The plain one looks all round 40 times a second. What it measured is told again as other sensors
would tell it; steps of a second are compared with the true ones.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import pytest

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.mapping.mapper import Mapper
from mapweave.scan.mounting import Mounting
from mapweave.scan.scan import Scan
from mapweave_deploy.sim.lidar import LidarParameters, measure
from mapweave_deploy.sim.office import office
from mapweave_deploy.sim.trajectories import TourParameters, plan_tours

pytestmark = pytest.mark.slow

RATE, SECONDS = 40, 30
BEAMS = 360  # of a turn
FARTHEST = 8.0  # [m] beyond it nothing comes back to sensors of less range
DISTANCE, TURN = 0.25, math.radians(5.0)  # [m], [rad] within which a step is right


@dataclass(frozen=True)
class Sweep:
    """A message as a driver fills it."""

    ranges: FloatArray
    angle_min: float
    angle_increment: float
    stamp: float
    range_max: float = 30.0

    def scan(self, index: int) -> Scan:
        """Return what mapweave makes of it."""
        return Scan.of(
            self.ranges,
            self.angle_min,
            self.angle_increment,
            range_max=self.range_max,
            index=index,
            stamp=self.stamp,
        )


@cache
def drive() -> tuple[list[Sweep], FloatArray]:
    """Return what the plain sensor measures, and its true (n, 3) poses."""
    rng = np.random.default_rng(3)
    world = office(2)
    lidar = LidarParameters(beams=BEAMS, field_of_view=math.radians(BEAMS - 1))
    plan = TourParameters(scan_rate=RATE, length=0.4 * SECONDS)
    (tour,) = plan_tours(world, 1, plan, rng)
    step = math.radians(1.0)
    sweeps, poses = [], []
    for stamp, pose in zip(tour.stamp.tolist(), tour.pose, strict=True):
        if stamp > SECONDS:
            break
        sweeps.append(Sweep(measure(world, pose, lidar, rng), -179.5 * step, step, 100.0 + stamp))
        poses.append(pose)
    return sweeps, np.array(poses)


Sensor = Callable[[int, Sweep], Sweep]


def plain(_: int, sweep: Sweep) -> Sweep:
    return sweep


def clockwise(_: int, sweep: Sweep) -> Sweep:
    last = sweep.angle_min + sweep.angle_increment * (len(sweep.ranges) - 1)
    return replace(
        sweep,
        ranges=sweep.ranges[::-1],
        angle_min=last,
        angle_increment=-sweep.angle_increment,
    )


def narrow(degrees: int) -> Sensor:
    def look(_: int, sweep: Sweep) -> Sweep:
        skipped = (BEAMS - degrees) // 2
        first = sweep.angle_min + skipped * sweep.angle_increment
        return replace(sweep, ranges=sweep.ranges[skipped : skipped + degrees], angle_min=first)

    return look


def doubled(_: int, sweep: Sweep) -> Sweep:
    """The last beam looks where the first did."""
    return replace(sweep, ranges=np.append(sweep.ranges, sweep.ranges[0]))


def changing(number: int, sweep: Sweep) -> Sweep:
    """Some beams more or fewer each time, as of a motor that is not regulated."""
    left_out = (number * 7) % 23
    return replace(sweep, ranges=sweep.ranges[: len(sweep.ranges) - left_out])


def telling(nothing: float) -> Sensor:
    """What is far away, and every tenth reading, does not come back, and is told so."""

    def look(number: int, sweep: Sweep) -> Sweep:
        lost = np.random.default_rng(number).random(len(sweep.ranges)) < 0.1
        far = sweep.ranges >= FARTHEST
        return replace(
            sweep, ranges=np.where(lost | far, nothing, sweep.ranges), range_max=FARTHEST
        )

    return look


def stamped(stamp: Callable[[int, float], float]) -> Sensor:
    return lambda number, sweep: replace(sweep, stamp=stamp(number, sweep.stamp))


def heard(sensor: Sensor, every: int = 1) -> Iterator[Scan]:
    """Yield the scans of a sensor that measures one time in `every`."""
    for number, sweep in enumerate(drive()[0]):
        if number % every == 0:
            yield sensor(number, sweep).scan(number)


def steps_right(scans: Iterator[Scan]) -> float:
    """Return the share of the steps of a second that are right; those without a place are wrong."""
    mapper, found = Mapper(), {}
    for scan in scans:
        placement = mapper.add(scan)
        if placement.pose is not None:
            found[scan.index] = placement.component, placement.pose
    true = drive()[1]
    right = total = 0
    for number in range(0, len(true) - RATE, RATE // 2):
        total += 1
        if number in found and number + RATE in found:
            (one, start), (other, end) = found[number], found[number + RATE]
            x, y, turn = se2.between(
                se2.between(true[number], true[number + RATE]), se2.between(start, end)
            )
            right += one == other and math.hypot(x, y) < DISTANCE and abs(turn) < TURN
    return right / total


@cache
def of_plain() -> float:
    return steps_right(heard(plain))


def test_the_plain_sensor_maps_the_office() -> None:
    assert of_plain() > 0.98


@pytest.mark.parametrize(
    ("sensor", "every"),
    [
        pytest.param(clockwise, 1, id="clockwise"),
        pytest.param(narrow(270), 1, id="270 degrees"),
        pytest.param(narrow(180), 1, id="180 degrees"),
        pytest.param(plain, 2, id="20 Hz"),
        pytest.param(plain, 4, id="10 Hz"),
        pytest.param(doubled, 1, id="doubled end beam"),
        pytest.param(changing, 1, id="changing number of beams"),
        pytest.param(telling(0.0), 1, id="no return as 0"),
        pytest.param(telling(math.inf), 1, id="no return as infinity"),
        pytest.param(telling(math.nan), 1, id="no return as NaN"),
        pytest.param(telling(FARTHEST), 1, id="no return as the maximum"),
        pytest.param(stamped(lambda n, s: s if n % 5 else s - 0.025), 1, id="stamps that repeat"),
        pytest.param(stamped(lambda n, s: s if n % 40 else s - 3.0), 1, id="stamps that run back"),
        pytest.param(stamped(lambda n, s: s + 1e6 * (n > 500)), 1, id="stamps that jump"),
        pytest.param(stamped(lambda *_: 17.0), 1, id="stamps that stand still"),
    ],
)
def test_another_sensors_steps_are_as_right_as_the_plain_ones(sensor: Sensor, every: int) -> None:
    assert steps_right(heard(sensor, every)) > of_plain() - 0.01


def test_a_sensor_that_hangs_upside_down_is_right_where_that_is_said() -> None:
    def hanging(_: int, sweep: Sweep) -> Sweep:
        return replace(sweep, ranges=sweep.ranges[::-1])  # its left is the robot's right

    mounting = Mounting(upside_down=True)
    scans = (mounting.turned(scan) for scan in heard(hanging))
    assert steps_right(scans) > of_plain() - 0.01


@pytest.mark.parametrize(
    ("sensor", "every"),
    [pytest.param(narrow(90), 1, id="90 degrees"), pytest.param(plain, 10, id="4 Hz")],
)
def test_the_least_sensors_map_almost_as_well(sensor: Sensor, every: int) -> None:
    assert steps_right(heard(sensor, every)) > of_plain() - 0.05
