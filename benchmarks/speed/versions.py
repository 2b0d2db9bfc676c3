"""What a version of the joint map costs, and what encoding costs, by the size of the team."""

import time
from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from benchmarks.speed.rows import Report, timed
from mapweave.config import Config
from mapweave.fusion.align import align
from mapweave.geometry import se2
from mapweave.mapping.mapper import Mapper
from mapweave.maps import RobotMap
from mapweave.scan.scan import Scan
from mapweave_deploy.sim.lidar import LidarParameters, measure
from mapweave_deploy.sim.office import office
from mapweave_deploy.sim.trajectories import Tour, TourParameters, plan_tours
from mapweave_deploy.sim.world import World
from mapweave_fusion_server.builder import Built, VersionBuilder
from mapweave_fusion_server.coordinator import Coordinator, CoordinatorParameters
from mapweave_protocol.wire.codec import encode
from mapweave_protocol.wire.messages import (
    AlignmentMessage,
    JointMapMessage,
    MapMessage,
    MapVersion,
)

ROBOTS = (2, 8, 20)
TOUR = TourParameters(length=25.0, candidates=4)
CHANGES = 6  # versions of which each has one submap changed
NEIGHBOURS = 3  # robots that each is compared with: the next ones


def measure_versions(report: Report) -> None:
    """Measure versions of teams in the simulated office: each of one submap changed."""
    maps = _map_office(max(ROBOTS))
    messages = _compare_neighbours(maps)
    medians = [_measure_team(report, maps[:robots], messages) for robots in ROBOTS]
    report.grow("version, one submap changed", "robots", ROBOTS, medians)
    report.reach(f"version of {ROBOTS[-1]} robots, one submap changed", medians[-1], 100, "ms")
    packed = [timed(partial(_encoded, m))[1] for m in maps for _ in range(5)]
    report.time("map message encoded", f"{_segments(maps)} segments", packed)


def _encoded(robot_map: RobotMap) -> bytes:
    return encode(MapMessage.pack(robot_map))


def _segments(maps: Sequence[RobotMap]) -> int:
    """Return how many segments a map has, at the median."""
    return int(np.median([sum(len(s.map.segments) for s in m.submaps) for m in maps]))


def _map_office(robots: int) -> list[RobotMap]:
    world = office(1)
    tours = plan_tours(world, robots, TOUR, np.random.default_rng(1))
    return [_map_tour(world, f"r{k}", tour, k) for k, tour in enumerate(tours)]


def _map_tour(world: World, robot: str, tour: Tour, seed: int) -> RobotMap:
    lidar, rng, mapper = LidarParameters(), np.random.default_rng(seed), Mapper(robot)
    for stamp, pose in zip(tour.stamp, tour.pose, strict=True):
        ranges = measure(world, pose, lidar, rng)
        returned = np.where(ranges < lidar.maximum_range, ranges, 0.0)
        mapper.add(Scan(returned, lidar.angles, stamp=float(stamp)))
    return mapper.finish()


def _compare_neighbours(maps: Sequence[RobotMap]) -> list[AlignmentMessage]:
    return [
        AlignmentMessage.pack(
            maps[a].robot, _version(maps[a]), _version(maps[b]), align(maps[a], maps[b])
        )
        for a in range(len(maps))
        for b in range(a + 1, min(a + 1 + NEIGHBOURS, len(maps)))
    ]


def _version(robot_map: RobotMap) -> MapVersion:
    return MapVersion(robot=robot_map.robot, boot=robot_map.boot, version=robot_map.version)


def _measure_team(
    report: Report, maps: Sequence[RobotMap], messages: Sequence[AlignmentMessage]
) -> float:
    """Measure the versions of one team; return the median of those of one change [ms]."""
    coordinator = Coordinator(CoordinatorParameters())
    for robot_map in maps:
        coordinator.receive_map(robot_map)
    names = {m.robot for m in maps}
    for message in messages:
        if {message.reference.robot, message.other.robot} <= names:
            coordinator.receive_alignments(message)
    of = f"{len(maps)} robots"
    with VersionBuilder("speed", Config()) as builder:
        built, first = timed(lambda: _build(coordinator, builder))
        report.time("version, the first", of, [first])
        times = []
        for k in range(CHANGES):
            coordinator.receive_map(_changed(maps[k % len(maps)], k))
            built, seconds = timed(lambda: _build(coordinator, builder))
            times.append(seconds)
    encoded = [timed(lambda: encode(JointMapMessage.pack(built.joint, "speed")))[1] for _ in times]
    report.time("joint message encoded", of, encoded)
    return report.time("version, one submap changed", of, times).median


def _build(coordinator: Coordinator, builder: VersionBuilder) -> Built:
    """Build the next version, encoded as it is sent.

    Raises
    ------
    RuntimeError
        If it cannot be built; why, is logged.
    """
    builder.start(coordinator.begin(time.time()), time.time())
    built = builder.take()
    coordinator.finish(built.joint if built else None)
    if built is None:
        raise RuntimeError("a version could not be built")
    return built


def _changed(robot_map: RobotMap, times: int) -> RobotMap:
    """Return the map, newer, its last submap moved by a centimetre."""
    *others, last = robot_map.submaps
    moved = replace(last, pose=se2.compose(last.pose, np.array([0.01, 0.0, 0.0])))
    return replace(robot_map, version=robot_map.version + 1 + times, submaps=(*others, moved))
