"""Robots as they are: recordings of few scans, cluttered halls, people, own bodies, open places."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from benchmarks.logs import Log, find_logs, load_scans, load_truth
from mapweave.geometry.arrays import FloatArray
from mapweave.scan.scan import Scan
from mapweave_deploy.sim.lidar import LidarParameters
from mapweave_deploy.sim.lidars import LIDARS
from mapweave_deploy.sim.office import office
from mapweave_deploy.sim.own_body import OwnBodyParameters
from mapweave_deploy.sim.people import PeopleParameters
from mapweave_deploy.sim.settings import SETTINGS, Setting
from mapweave_deploy.sim.sweeps import SweepParameters, sweeps
from mapweave_deploy.sim.trajectories import Tour, TourParameters, drive, plan_tours
from mapweave_deploy.sim.world import World, box, disc, make_world
from tests.conftest import DATA

SPARSE = ("intel", "csail-thinned", "fr079", "killian")
LONG = ("killian",)  # of which only those from the first scan on are asked
TEN_MINUTES = 600.0  # [s]
BODIES = (30, 90, 120, 150)  # [°]


@dataclass(frozen=True, slots=True, eq=False)
class Case:
    """What a robot goes through.

    Attributes
    ----------
    group, name
        Which bars it is to clear, and which of the group it is.
    scans, truth
        (n,) what it sees, and (n, 3) from where [m, m, rad]; NaN where that is not known.
    """

    group: str
    name: str
    scans: list[Scan]
    truth: FloatArray


def recordings() -> Iterator[Case]:
    """Yield the logs that are sparse, cluttered, or short."""
    for name in ("fhw", "exp1", "exp2"):
        path = DATA / f"{name}.log.gz"
        if path.is_file():
            yield recording(name, Log(name, name, path, path), 1)
        else:
            print(f"{name} left out: there is no {path} (MAPWEAVE_DATA names the folder)")
    for log in find_logs(SPARSE):
        for every in (2, 3, 4):
            firsts = range(1) if log.name in LONG else range(every)
            yield from (recording(f"every {every}", log, every, first) for first in firsts)


def recording(group: str, log: Log, every: int, first: int = 0) -> Case:
    """Return one in so many scans of a log, from the `first` one on."""
    scans = load_scans(log)
    known = group not in ("exp1", "exp2")  # the poses in these are of wheels
    truth = np.full((len(scans), 3), np.nan)
    if known:
        truth = load_truth(log, np.array([scan.stamp for scan in scans]))
    kept = [replace(scan, index=k) for k, scan in enumerate(scans[first::every])]
    name = f"{log.name} from {first}" if first else log.name
    return Case(group, name, kept, truth[first::every])


def simulated(seconds: float) -> Iterator[Case]:
    """Yield drives of so many `seconds` at the most, among people and as a robot sees itself."""
    for along in range(1, 7):
        world, tour = office_tour(along, seconds)
        around = SweepParameters(people=PeopleParameters(along=along))
        yield seen("people", f"{along} along", world, tour, around)
    for rate in (10.0, 40.0):
        world, tour = office_tour(1, 60.0)
        rest = Tour(np.arange(10 * rate) / rate, np.tile(tour.pose[20], (int(10 * rate), 1)))
        around = SweepParameters(people=PeopleParameters(passing=4))
        yield seen("people", f"4 pass, {rate:g} Hz", world, rest, around)
    for width in (0, *BODIES):
        world, tour = office_tour(7, 60.0)
        around = SweepParameters(body=OwnBodyParameters(width=np.radians(width)))
        yield seen("body", f"{width}° hidden", world, tour, around)
    for name, (free, way, far) in OPEN.items():
        world = make_world(name, free, shapely.Polygon(), np.zeros((1, 2)))
        parameters = TourParameters(scan_rate=10.0, speed=0.8)
        around = SweepParameters(lidar=LidarParameters(maximum_range=far))
        yield seen("open", name, world, drive(np.array(way), parameters), around)


def worlds(seeds: int) -> Iterator[Case]:
    """Yield a drive through each built-in world, made from so many seeds."""
    for name, setting in SETTINGS.items():
        for seed in range(1, seeds + 1):
            yield _driven(_group(name), f"{name} {seed}", setting, seed)


def crowds(seeds: int) -> Iterator[Case]:
    """Yield a drive among people who walk along and pass, of each lidar, from so many seeds."""
    for name, lidar in LIDARS.items():
        if name in ("upside-down", "mirrored"):
            continue
        plain = lidar.parameters.model_copy(update={"order": "counter-clockwise"})
        setting = SETTINGS["crowd"].with_lidar(lidar._replace(parameters=plain))
        for seed in range(1, seeds + 1):
            yield _driven("crowd", f"{name} {seed}", setting, seed)


def _driven(group: str, name: str, setting: Setting, seed: int) -> Case:
    ground, [place] = setting.places(seed, 1)
    [tour] = plan_tours(ground, 1, setting.tours, np.random.default_rng([seed, 1]))
    return seen(group, name, place, tour, setting.sweeps)


def _group(world: str) -> str:
    """Return which bars a world is to clear: in some, nothing tells how far a robot went."""
    return "open" if world in ("hall", "round") else "world"


def office_tour(seed: int, seconds: float) -> tuple[World, Tour]:
    """Return an office and a drive through it, to and fro until its time is over."""
    world = office(seed)
    [tour] = plan_tours(world, 1, TourParameters(), np.random.default_rng(seed))
    laps = int(np.ceil(seconds / tour.stamp[-1]))
    back = np.array(tour.pose[::-1])
    back[:, 2] += np.pi
    turned = np.concatenate([[tour.pose, back][lap % 2] for lap in range(laps)])
    count = min(len(turned), int(seconds * TourParameters().scan_rate))
    return world, Tour(np.arange(count) / TourParameters().scan_rate, turned[:count])


def seen(group: str, name: str, world: World, tour: Tour, around: SweepParameters) -> Case:
    """Return what a robot sees on a tour."""
    rng, others = (np.random.default_rng([7, part]) for part in (1, 2))
    lidar = around.lidar
    scans = [
        Scan(np.where(r < lidar.maximum_range, r, np.nan), lidar.angles, k, float(stamp))
        for k, (r, stamp) in enumerate(
            zip(sweeps(world, tour, around, rng, others), tour.stamp, strict=True)
        )
    ]
    return Case(group, name, scans, tour.pose)


def _line(length: float) -> list[tuple[float, float]]:
    """Return a way along x, every 2 cm."""
    return [(x, 0.0) for x in np.arange(0.0, length, 0.02)]


def _colonnade() -> BaseGeometry:
    pillars = [box(x, y, 0.3, 0.3) for x in np.arange(-4.0, 16.0, 0.9) for y in (-1.6, 1.6)]
    return box(6.0, 0.0, 60.0, 40.0).difference(shapely.union_all(pillars))


def _circle(radius: float, around: float) -> list[tuple[float, float]]:
    """Return a way round in a circle."""
    turns = np.arange(0.0, around, 0.02 / radius)
    return [(radius * np.cos(t), radius * np.sin(t)) for t in turns]


_round = partial(shapely.Point(0.0, 0.0).buffer, 4.0, quad_segs=64)
# Each with the way that is driven, and how far is seen [m].
OPEN: dict[str, tuple[BaseGeometry, list[tuple[float, float]], float]] = {
    "round room": (_round(), _circle(2.0, 4.0), 30.0),
    "round room with a pillar": (_round().difference(disc(0.5, 0, 0.2)), _circle(2.0, 6.0), 30.0),
    "colonnade": (_colonnade(), _line(12.0), 12.0),
    "bare corridor": (box(20.0, 0.0, 80.0, 2.4), _line(40.0), 8.0),
    "blind gap": (box(10.0, 0.0, 24.0, 14.0), _line(18.0), 3.5),
    "hall with one wall": (box(20.0, 18.0, 80.0, 40.0), _line(30.0), 6.0),
}
