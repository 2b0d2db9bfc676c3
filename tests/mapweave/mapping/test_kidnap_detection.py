"""What a robot maps after a jump that it did not notice contradicts what it mapped before."""

from collections.abc import Sequence

import numpy as np
import pytest
from numpy.random import Generator

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.mapping.component_merging import ComponentMerger
from mapweave.mapping.kidnap_detection import (
    KidnapDetectionParameters,
    KidnapDetector,
    Kidnapping,
    contradictions,
    departs,
    refuted,
)
from mapweave.mapping.loops.loop_closing import SubmapMatch
from mapweave.mapping.mapper import Mapper
from mapweave.mapping.tracking.observation import ObservationParameters, observe
from mapweave.maps import LineMap, RobotMap, Submap, Trajectory
from mapweave.matching.distance_field import DistanceField, DistanceFieldParameters
from mapweave.matching.verification import Verdict
from mapweave.scan.points import OrientedPoints
from mapweave.scan.scan import Scan
from tests.mapweave.buildings import BUILDING, OTHER_BUILDING, cast, corridor, part, walls_of

P = KidnapDetectionParameters()


def verdict(common: float, contradicted: float) -> Verdict:
    return Verdict(common, contradicted, 0.5, 0.05, 3.0, 1.0)


@pytest.mark.parametrize(
    ("common", "contradicted", "expected"),
    [(100, 2, False), (100, 20, False), (20, 20, True), (0, 11, False), (-1, 13, True)],
)
def test_much_contradiction_and_a_large_share_of_it_is_a_departure(
    common: float, contradicted: float, expected: bool
) -> None:
    verdicts = [verdict(common / 2, contradicted / 2)] * 2
    assert departs(verdicts, P) == expected


def test_a_submap_that_nothing_was_compared_with_does_not_depart() -> None:
    assert not departs([], P)


def seen_at(outline: FloatArray, poses: FloatArray, rng: Generator) -> list[Scan]:
    return [cast(walls_of(outline), pose, noise=rng) for pose in poses]


def first_departed(scans: list[Scan], poses: FloatArray, frame: FloatArray) -> int:
    """Ask a map of the building of scans believed to be at `poses` (n, 3) of it."""
    raster = DistanceField.of(part(BUILDING, 0, 30), DistanceFieldParameters())
    oriented = [observe(scan, ObservationParameters()).oriented for scan in scans]
    local = se2.compose(se2.inverse(frame), poses)
    return int(np.argmin(contradictions(refuted(oriented, local, [(raster, frame)], P), P)))


def test_scans_where_they_are_believed_to_be_do_not_depart(rng: Generator) -> None:
    poses = np.array([[x, 1.0, 0.1] for x in np.arange(3, 9, 0.5)])
    assert first_departed(seen_at(BUILDING, poses, rng), poses, se2.IDENTITY) == len(poses)


@pytest.mark.parametrize("at", [0, 5, 9])
def test_the_first_scan_that_was_taken_elsewhere_departs(at: int, rng: Generator) -> None:
    """Whatever frame the poses are given in."""
    poses = np.array([[x, 1.0, 0.1] for x in np.arange(3, 9, 0.5)])
    here = seen_at(BUILDING, poses[:at], rng)
    there = seen_at(OTHER_BUILDING, poses[at:] + np.array([5.0, -3.0, 0.9]), rng)
    frame = np.array([4.0, -2.0, 1.0])
    assert abs(first_departed([*here, *there], poses, frame) - at) <= 1


def test_a_departure_into_a_look_alike_begins_with_the_first_scans_that_are_refuted_at_all() -> (
    None
):
    """A tenth of what is seen there, or less; of scans tracked rightly hardly anything is."""
    rightly = [0.0, 0.01, 0.03, 0.0, 0.01]
    shares = np.array([*rightly, 0.07, 0.07, 0.07, 0.07, 0.1, 0.2, 0.2])
    assert int(np.argmin(contradictions(shares, P))) == len(rightly)


def departure_of(here: int, elsewhere: int, rng: Generator, forget: bool = False) -> Kidnapping:
    """Drive 8 scans a submap; from the last `elsewhere` on in another building than believed.

    Only of the last of the submaps, number `here`, are comparisons enough to say so.
    """
    raster = DistanceField.of(part(BUILDING, 0, 30), DistanceFieldParameters())
    count = 8 * here
    poses = np.array([[2.0 + 0.3 * k, 1.0, 0.1] for k in range(count)])
    scans = seen_at(BUILDING, poses[: count - elsewhere], rng)
    scans += seen_at(OTHER_BUILDING, poses[count - elsewhere :] + np.array([5.0, -3.0, 0.9]), rng)
    oriented = [observe(scan, ObservationParameters()).oriented for scan in scans]
    known = Submap(0, 0, se2.IDENTITY, part(BUILDING, 0, 30), Trajectory.empty())
    submaps, kidnap_detector, found = [known], KidnapDetector(P), None
    for number in range(1, here + 1):
        span = slice(8 * (number - 1), 8 * number)
        local = se2.between(poses[span][0], poses[span])
        path = Trajectory(np.arange(8), np.zeros(8), local, None)
        submaps.append(Submap(number, 0, poses[span][0], LineMap.empty(), path))
        said = verdict(20, 20) if number == here else verdict(20, 4)
        compared = [SubmapMatch(known, raster, said, None)]
        found = kidnap_detector.find(submaps, oriented[span], compared, follows=True)
        if forget:
            kidnap_detector.forget()
        assert (found is None) == (number < here)
    assert found is not None
    return found


@pytest.mark.parametrize(
    ("elsewhere", "expected"), [(3, (3, 5)), (8, (3, 0)), (10, (2, 0)), (14, (2, 0)), (16, (2, 0))]
)
def test_a_departure_that_took_long_to_be_certain_is_found_in_an_earlier_submap(
    elsewhere: int, expected: tuple[int, int], rng: Generator
) -> None:
    """From its first scan on: a submap that was finished before is not cut in two."""
    found = departure_of(3, elsewhere, rng)
    assert (found.submap, found.scan) == expected


def test_submaps_that_others_hang_on_are_not_asked_again(rng: Generator) -> None:
    assert departure_of(3, 16, rng, forget=True) == Kidnapping(3, 0)


NICHES = ((4.0, 1.5, 0.8), (7.0, 2.5, 2.5), (11.5, 1.0, 1.6))
# The same niches twice, 30 m apart; those in between and beyond are of other kinds.
TWINS = corridor(
    64.0,
    [(s + x, s + x + w, d) for s in (2.0, 32.0) for x, w, d in NICHES]
    + [(17.0, 21.0, 2.5), (24.0, 25.0, 0.7), (48.0, 49.5, 1.1), (53.0, 58.0, 2.0)],
    [(18.5, 20.0, 1.0), (26.0, 29.5, 1.8), (50.0, 51.0, 1.5), (55.0, 56.5, 0.6)],
)


def test_a_jump_into_a_look_alike_is_found_out_and_undone(rng: Generator) -> None:
    """Nothing at the jump tells of it: what the robot sees goes on as it did."""
    walls = walls_of(TWINS)
    out = [[x, 1.1, 0.0] for x in np.arange(1, 62, 0.5)]
    back = [[x, 1.1, np.pi] for x in np.arange(62, 1, -0.5)]
    turns = [
        [[x, 1.1, start + a] for a in np.arange(0.3, 3, 0.3)]
        for x, start in ((61.5, 0), (1.5, np.pi))
    ]
    before = [[x, 1.1, 0.0] for x in np.arange(1.5, 10, 0.5)]
    after = [[x, 1.1, 0.0] for x in np.arange(40, 60, 0.5)]
    poses = np.array([*out, *turns[0], *back, *turns[1], *before, *after])
    mapper = Mapper("a")
    said = [
        mapper.add(cast(walls, pose, index=k, noise=rng, max_range=7.0))
        for k, pose in enumerate(poses)
    ]
    robot_map = mapper.finish()
    assert not any(p.lost for p in said)
    where = {
        int(k): (s.component, se2.compose(s.pose, pose))
        for s in robot_map.submaps
        for k, pose in zip(s.trajectory.scan_index, s.trajectory.pose, strict=True)
    }
    assert sorted(where) == list(range(len(poses)))
    assert [s.id for s in robot_map.submaps] == list(range(len(robot_map.submaps)))
    true = se2.between(poses[0], poses[-1])
    component, last = where[len(poses) - 1]
    assert component == 0
    np.testing.assert_allclose(last[:2], true[:2], atol=0.5)


def forced_to_depart(monkeypatch: pytest.MonkeyPatch, newest: int, first: int) -> None:
    """Have it said, once submap `newest` is finished, that the robot departed at `first`."""
    find = KidnapDetector.find

    def said(
        self: KidnapDetector,
        submaps: Sequence[Submap],
        oriented: Sequence[OrientedPoints],
        compared: Sequence[SubmapMatch],
        follows: bool,
    ) -> Kidnapping | None:
        find(self, submaps, oriented, compared, follows)
        return Kidnapping(first, 0) if submaps[-1].id == newest else None

    monkeypatch.setattr(KidnapDetector, "find", said)


def driven(rng: Generator) -> tuple[FloatArray, RobotMap]:
    """Return the true poses of a drive through the twin corridor, and its map."""
    poses = np.array([[x, 1.1, 0.0] for x in np.arange(1, 62, 0.5)])
    mapper = Mapper("a")
    for k, pose in enumerate(poses):
        mapper.add(cast(walls_of(TWINS), pose, index=k, noise=rng, max_range=7.0))
    return poses, mapper.finish()


def test_submaps_that_depart_together_leave_together(
    rng: Generator, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And what is tracked from them goes on with them."""
    monkeypatch.setattr(ComponentMerger, "reunite", lambda _, submaps, __: (submaps, []))
    forced_to_depart(monkeypatch, newest=3, first=2)
    poses, robot_map = driven(rng)
    components = [s.component for s in robot_map.submaps]
    assert components == [0, 0] + [1] * (len(components) - 2)
    assert [s.id for s in robot_map.submaps] == list(range(len(components)))
    for component, start in ((0, 0), (1, 2)):
        first = robot_map.submaps[start]
        last = [s for s in robot_map.submaps if s.component == component][-1]
        apart = se2.between(
            se2.compose(first.pose, first.trajectory.pose[0]),
            se2.compose(last.pose, last.trajectory.pose[-1]),
        )
        ends = first.trajectory.scan_index[0], last.trajectory.scan_index[-1]
        np.testing.assert_allclose(apart, se2.between(*poses[list(ends)]), atol=0.25)
