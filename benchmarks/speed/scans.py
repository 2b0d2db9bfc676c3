"""What a scan costs, stage by stage, beside small_gicp's ICP on the same scans."""

import importlib
import time
from collections import defaultdict
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from types import ModuleType
from typing import Any

import numpy as np

from benchmarks.logs import find_logs
from benchmarks.speed.rows import Report, Row, timed
from mapweave.commands.garbage import spared
from mapweave.geometry.arrays import FloatArray
from mapweave.io.readers import read_scans
from mapweave.mapping.mapper import Mapper
from mapweave.mapping.placement import Placement
from mapweave.mapping.tracking.acceptance import ScanMatch
from mapweave.mapping.tracking.observation import Observation
from mapweave.maps import RobotMap
from mapweave.scan.scan import Scan
from mapweave_deploy.sim.lidar import LidarParameters, measure
from mapweave_deploy.sim.office import office
from mapweave_deploy.sim.trajectories import TourParameters, plan_tours
from tests.conftest import DATA

BEAMS = (180, 360, 720, 1440)
TURN_BY_TURN = 25  # scans: mapweave's and the peer's turns alternate, so that both meet the same
WARM = 10  # scans before which nothing counts
CELL, NEIGHBOURS, REACH, ROUNDS = 0.02, 8, 0.7, 30  # [m], -, [m], -: small_gicp's
EXTRA = "pip install -e '.[peers]' brings it"


class TimedMapper(Mapper):
    """A mapper that counts the processor time of each stage, all threads together [s].

    Attributes
    ----------
    scans
        Of each scan, by stage: ``observe``, ``track``, ``merge`` and ``submap``, the last for the
        scans that finish one.
    """

    def __init__(self) -> None:
        super().__init__()
        self.scans: list[dict[str, float]] = []
        self._running: list[str] = []
        self._since = 0.0

    def add(self, scan: Scan) -> Placement:
        """Take the next scan."""
        self.scans.append(defaultdict(float))
        with self._stage("observe"):
            return super().add(scan)

    def finish(self) -> RobotMap:
        """Finish the growing submap; its time is that of one scan more."""
        self.scans.append(defaultdict(float))
        with self._stage("submap"):
            return super().finish()

    def _place(self, seen: Observation) -> bool:
        with self._stage("track"):
            return super()._place(seen)

    def _merge(self, seen: Observation, tracked: ScanMatch) -> None:
        with self._stage("merge"):
            super()._merge(seen, tracked)

    def _finish_submap(self) -> None:
        with self._stage("submap"):
            super()._finish_submap()

    @contextmanager
    def _stage(self, name: str) -> Iterator[None]:
        """Count what passes for the stage, less what passes in stages within it."""
        self._count()
        self._running.append(name)
        try:
            yield
        finally:
            self._count()
            self._running.pop()

    def _count(self) -> None:
        now = time.process_time()
        if self._running:
            self.scans[-1][self._running[-1]] += now - self._since
        self._since = now


class Gicp:
    """small_gicp's ICP from each scan to the next, as one would use it: its times [s].

    It aligns points in space: of (n, 2) it returns a perfect fit of nothing, so z is 0.
    """

    def __init__(self, package: ModuleType) -> None:
        self.times: list[float] = []
        self._package = package
        self._motion = np.eye(4)
        self._before: tuple[Any, Any] | None = None

    def add(self, scan: Scan) -> None:
        """Align the next scan to the one before, starting from the last motion."""
        points = scan.points[scan.hits]
        flat = np.column_stack([points, np.zeros(len(points))])
        self.times.append(timed(lambda: self._align(flat))[1])

    def _align(self, points: FloatArray) -> None:
        prepared = self._package.preprocess_points(
            points, downsampling_resolution=CELL, num_neighbors=NEIGHBOURS, num_threads=1
        )
        if self._before is not None:
            found = self._package.align(
                self._before[0],
                prepared[0],
                self._before[1],
                init_T_target_source=self._motion,
                registration_type="ICP",
                max_correspondence_distance=REACH,
                max_iterations=ROUNDS,
                num_threads=1,
            )
            self._motion = found.T_target_source
        self._before = prepared


@dataclass(frozen=True, slots=True, eq=False)
class Mapped:
    """What mapping scans took.

    Attributes
    ----------
    robot_map
        The map, for what comes after.
    stages
        (n, 4) of each scan [s]: observe, track, merge, submap; of `finish` last.
    peer
        (n,) small_gicp's [s]; empty where it is not installed.
    """

    robot_map: RobotMap
    stages: FloatArray
    peer: FloatArray

    @property
    def followed(self) -> FloatArray:
        """(n,) observed, tracked and merged, of each scan after the first ones [s]."""
        return np.asarray(self.stages[WARM:-1, :3].sum(axis=1))

    @property
    def everything(self) -> float:
        """A scan's share of all the time, finishing included [s]."""
        return float(self.stages[WARM:].sum() / (len(self.stages) - 1 - WARM))


STAGES = ("observe", "track", "merge", "submap")


def map_timed(scans: Sequence[Scan], package: ModuleType | None = None) -> Mapped:
    """Map `scans`, and have small_gicp follow them in turn."""
    mapper, peer = TimedMapper(), Gicp(package) if package else None
    with spared():  # as the commands do that map
        for first in range(0, len(scans), TURN_BY_TURN):
            part = scans[first : first + TURN_BY_TURN]
            for scan in part:
                mapper.add(scan)
            if peer:
                for scan in part:
                    peer.add(scan)
    robot_map = mapper.finish()
    stages = np.array([[each[name] for name in STAGES] for each in mapper.scans])
    return Mapped(robot_map, stages, np.array(peer.times[1:] if peer else []))


def find_gicp(report: Report) -> ModuleType | None:
    """Return the package small_gicp; None, and said in the report, where it is not there."""
    try:
        return importlib.import_module("small_gicp")
    except ImportError as error:
        report.leave_out("small_gicp", f"{error}; {EXTRA}")
        return None


def measure_log(report: Report, log: str, most: int) -> float | None:
    """Measure the first `most` scans of `log`; return what all of it takes a scan [ms]."""
    logs = find_logs([log])
    if not logs:
        report.leave_out(log, "its file is missing")
        return None
    scans, reading = timed(lambda: _some(read_scans(logs[0].path, on_warning=print), most))
    done = map_timed(scans, find_gicp(report))
    of = f"{log}, {len(scans)} scans"
    _tell_stages(report, of, done)
    mapped = 1000 * (done.everything + reading / len(scans))
    lasted = scans[-1].stamp - scans[0].stamp
    speed = 1000 * lasted / (mapped * len(scans))
    report.reach("map, all included: times real time", speed, 100, at_least=True)
    if len(done.peer):
        _beside(report, report.time("scan, small_gicp ICP", of, done.peer), done, mapped)
    return mapped


def _some(scans: Iterator[Scan], most: int) -> list[Scan]:
    return [scan for scan, _ in zip(scans, range(most or 10**9), strict=False)]


def _tell_stages(report: Report, of: str, done: Mapped) -> Row:
    """Keep the stages of a scan, and return the row of what follows it, submaps left out."""
    for column, stage in enumerate(STAGES[:3]):
        report.time(f"scan, {stage}", of, done.stages[WARM:-1, column])
    submaps = done.stages[WARM:, 3]
    if (submaps > 0).any():
        report.time("submap finished", of, submaps[submaps > 0])
    report.time("scan, everything", of, done.stages[WARM:].sum(axis=1))
    return report.time("scan, observed, tracked, merged", of, done.followed)


def _beside(report: Report, peer: Row, done: Mapped, mapped: float) -> None:
    """Keep the ratios to the `peer`'s median; `mapped` [ms] a scan, reading included."""
    followed = 1000 * done.followed
    report.reach("scan tracked, merged / small_gicp, mean", followed.mean() / peer.median, 3)
    most = float(np.percentile(followed, 99))
    report.reach("scan tracked, merged / small_gicp, 99 %", most / peer.median, 15)
    report.reach("map, all included / small_gicp", mapped / peer.median, 6)


def measure_beams(report: Report, count: int) -> None:
    """Measure `count` scans of one drive through a simulated office by lidars of many beams."""
    means, package = dict[int, float](), find_gicp(report)
    for beams in BEAMS:
        done = map_timed(simulated_scans(beams, count), package)
        of = f"office, {beams} beams"
        followed = _tell_stages(report, of, done)
        means[beams] = followed.mean
        if len(done.peer):
            report.time("scan, small_gicp ICP", of, done.peer)
    report.grow("scan tracked, merged", "beams", BEAMS, [means[beams] for beams in BEAMS])
    report.reach("scan at 1440 beams / at 360", means[1440] / means[360], 6)


def simulated_scans(beams: int, count: int, seed: int = 1) -> list[Scan]:
    """Return the first `count` scans of a drive through the office of the demo."""
    world, rng = office(seed), np.random.default_rng([seed, beams])
    (tour,) = plan_tours(world, 1, TourParameters(), np.random.default_rng(seed))
    lidar = LidarParameters(beams=beams)
    return [
        Scan(
            np.where((found := measure(world, pose, lidar, rng)) < lidar.maximum_range, found, 0.0),
            lidar.angles,
            stamp=float(stamp),
        )
        for stamp, pose in zip(tour.stamp[:count], tour.pose, strict=False)
    ]


def measure_lost(report: Report, most: int) -> None:
    """Measure a log in which the robot is lost again and again."""
    path = DATA / "fhw.log.gz"
    if not path.is_file():
        report.leave_out("a robot lost in a hall", f"there is no {path}")
        return
    done = map_timed(_some(read_scans(path, on_warning=lambda _: None), most))
    of = f"fhw, {len(done.stages) - 1} scans, {len(done.robot_map.components)} pieces"
    followed = _tell_stages(report, of, done)
    worst = 1000 * float(done.followed.max())
    report.reach("lost in a hall: worst scan / median", worst / followed.median, 10)
