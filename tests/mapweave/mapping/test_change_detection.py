"""What is seen through for good has gone, and is not kept; what stands is."""

import numpy as np
import pytest
from numpy.random import Generator

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.mapping.change_detection import (
    ChangeDetectionParameters,
    Viewpoint,
    denials,
    last_sightings,
    still_there,
)
from mapweave.mapping.mapper import Mapper
from mapweave.mapping.submap_builder import SubmapBuilder, SubmapParameters
from mapweave.maps import LineMap
from mapweave.scan.segmentation import extract_segments
from tests.mapweave.buildings import AROUND, cast, random_pose, rectangle, walls_of

ROOM = walls_of(rectangle(0, 0, 8, 5))
PERSON = walls_of(rectangle(4.0, 3.2, 4.4, 3.5)[::-1])  # the outside visible
ALL = ChangeDetectionParameters()


def path(count: int) -> FloatArray:
    """(count, 3) poses from left to right, looking into the room."""
    return np.column_stack(
        [np.linspace(1, 6, count), np.full(count, 1.0), np.linspace(0.3, 1.2, count)]
    )


def grown(walls_at: list[FloatArray], rng: Generator) -> LineMap:
    """Return the lines of the scans of one place after the other, each with its own walls."""
    submap = SubmapBuilder(SubmapParameters())
    for k, (walls, pose) in enumerate(zip(walls_at, path(len(walls_at)), strict=True)):
        scan = cast(walls, pose, index=k, angles=AROUND, noise=rng)
        submap.add(scan, extract_segments(scan).segments, pose)
    return submap.line_map()


def on_the_person(lines: LineMap) -> FloatArray:
    """(k, 4) segments that lie where the person stood."""
    middle = (lines.segments[:, :2] + lines.segments[:, 2:]) / 2
    return lines.segments[(np.abs(middle - [4.2, 3.35]) < 0.5).all(axis=1)]


def test_a_person_who_stood_there_for_a_while_and_left_is_not_in_the_map(rng: Generator) -> None:
    stays, leaves = np.vstack([ROOM, PERSON]), ROOM
    assert len(on_the_person(grown([stays] * 8, rng)))
    assert len(on_the_person(grown([stays] * 8 + [leaves] * 12, rng))) == 0


def test_a_person_who_crosses_the_room_leaves_no_trace_in_a_robots_map(rng: Generator) -> None:
    mapper = Mapper("a")
    poses = path(24)
    for k, pose in enumerate(poses):
        step = min(k, 10) * np.array([0.0, -0.25, 0.0, -0.25])
        person = PERSON + step + [1.5, 1.0, 1.5, 1.0] if k <= 10 else np.empty((0, 4))
        scan = cast(np.vstack([ROOM, person]), pose, index=k, angles=AROUND, noise=rng)
        assert mapper.add(scan).placed
    walls = se2.transform_segments(poses[0], mapper.finish().lines(0).segments)
    inside = (walls > 0.3).all(axis=1) & (walls < [7.7, 4.7, 7.7, 4.7]).all(axis=1)
    assert len(walls) >= 4
    assert not inside.any()


def test_who_comes_and_stays_is_in_the_map(rng: Generator) -> None:
    """The last word counts: a door that was open and is shut now is a wall."""
    stays, before = np.vstack([ROOM, PERSON]), ROOM
    assert len(on_the_person(grown([before] * 12 + [stays] * 8, rng)))


def test_nothing_that_stands_loses_any_support(rng: Generator) -> None:
    """Nor does what is hidden, behind the robot or out of sight for the time being."""
    poses = path(20)
    scans = [
        cast(np.vstack([ROOM, PERSON]), pose, index=k, noise=rng) for k, pose in enumerate(poses)
    ]
    witnesses = [Viewpoint(scan, pose) for scan, pose in zip(scans, poses, strict=True)]
    segments = np.vstack([ROOM, PERSON])
    seen_first = np.zeros(len(segments), dtype=np.int64)
    assert not denials(segments, seen_first, witnesses, ALL).any()


def test_a_wall_grazed_a_little_off_its_place_is_not_seen_through(rng: Generator) -> None:
    """Beams along a wall that was mapped 5 cm too near pass it by metres before they hit."""
    wall = np.array([[7.5, 0.05, 5.5, 0.05]])
    pose = np.array([0.5, 0.3, 0.0])
    fine = np.radians(np.arange(-180, 180, 0.25))
    witness = [Viewpoint(cast(ROOM, pose, index=5, angles=fine, noise=rng), pose)]
    seen = np.zeros(1, dtype=np.int64)
    assert denials(wall, seen, witness, ChangeDetectionParameters(incidence=0.0))[0] == 1
    assert denials(wall, seen, witness, ALL)[0] == 0


def test_only_later_scans_deny_what_was_seen() -> None:
    pose = np.array([4.0, 1.0, np.pi / 2])
    witnesses = [Viewpoint(cast(ROOM, pose, index=k), pose) for k in range(6)]
    counts = denials(np.repeat(PERSON[:1], 3, axis=0), np.array([-1, 3, 9]), witnesses, ALL)
    assert counts.tolist() == [6, 2, 0]


def test_it_does_not_matter_in_which_frame_it_is_asked(rng: Generator) -> None:
    moved = random_pose(rng)
    witnesses = [
        Viewpoint(cast(ROOM, pose, index=k + 1, noise=rng), pose) for k, pose in enumerate(path(10))
    ]
    elsewhere = [Viewpoint(w.scan, se2.compose(moved, w.pose)) for w in witnesses]
    segments = np.vstack([ROOM, PERSON])
    seen = np.zeros(len(segments), dtype=np.int64)
    here = denials(segments, seen, witnesses, ALL)
    there = denials(se2.transform_segments(moved, segments), seen, elsewhere, ALL)
    np.testing.assert_array_equal(here, there)
    assert here[len(ROOM) :].max() >= ALL.places


@pytest.mark.parametrize(("seen", "left", "support"), [(0, [], []), (3, [0], [8]), (5, [0], [10])])
def test_each_place_that_sees_through_takes_a_sighting_and_enough_of_them_the_segment(
    seen: int, left: list[int], support: list[int]
) -> None:
    pose = np.array([4.0, 1.0, np.pi / 2])
    witnesses = [Viewpoint(cast(ROOM, pose, index=k), pose) for k in range(6)]
    found = still_there(PERSON[:1], np.array([10]), np.array([seen]), witnesses, ALL)
    assert (found[0].tolist(), found[1].tolist()) == (left, support)


def test_the_last_sighting_is_that_of_the_last_scan_not_the_last_added() -> None:
    """A scan that waited is added late."""
    last = last_sightings(np.array([0, 1, 0, 1]), np.array([7, 4, 5, 6]))
    assert last.tolist() == [7, 6]


def test_an_empty_map_loses_nothing() -> None:
    none = np.empty(0, dtype=np.int64)
    left, support = still_there(np.empty((0, 4)), none, last_sightings(none, none), [], ALL)
    assert len(left) == len(support) == 0
