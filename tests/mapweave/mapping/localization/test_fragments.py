"""What a robot mapped while it was lost is taken up where it can have been, and nowhere else."""

from collections.abc import Sequence

import numpy as np
import pytest

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.mapping.localization.fragments import FragmentFinder, FragmentParameters
from mapweave.mapping.tracking.observation import Observation, ObservationParameters, observe
from mapweave.maps import LineMap, Submap, Trajectory
from tests.mapweave.buildings import BUILDING, part, random_pose, scans_along, shaken

WAY = [(3, 1), (13, 1), (13, -3), (13, 1), (18, 1), (18, 4), (18, 1), (28, 1)]
LOST = 60  # the scans from here on are those of a fragment


@pytest.fixture(scope="module")
def drive() -> tuple[list[Observation], FloatArray]:
    scans, poses = scans_along(BUILDING, WAY, 1)
    return [observe(scan, ObservationParameters()) for scan in scans], np.array(poses)


def tracked(seen: Sequence[Observation], poses: FloatArray) -> Trajectory:
    """Return the path of scans, which take a tenth of a second each."""
    numbers = np.array([each.scan.index for each in seen])
    return Trajectory(numbers, numbers / 10, poses)


def mapped(lines: LineMap, drive: tuple[list[Observation], FloatArray], until: int) -> Submap:
    """Return `lines` as mapped by scans before number `until`."""
    seen, poses = drive
    noisy = shaken(lines, np.random.default_rng(2))
    return Submap(0, 0, np.zeros(3), noisy, tracked(seen[:until], poses[:until]))


def fragment(
    drive: tuple[list[Observation], FloatArray], start: int, count: int, frame: FloatArray
) -> tuple[Submap, list[Observation]]:
    """Return scans from number `start` on, in a component whose frame is at `frame` (3,)."""
    seen, poses = drive[0][start : start + count], drive[1][start : start + count]
    own = se2.compose(se2.inverse(frame), poses)
    return Submap(1, 1, np.zeros(3), LineMap.empty(), tracked(seen, own)), seen


@pytest.mark.parametrize("count", [1, 6])
def test_scans_that_were_missed_are_taken_up_where_they_were_taken(
    drive: tuple[list[Observation], FloatArray], count: int
) -> None:
    frame = random_pose(np.random.default_rng(count))
    lost, seen = fragment(drive, LOST, count, frame)
    finder = FragmentFinder()
    finder.note(lost, seen)
    found = finder.take_up([mapped(part(BUILDING, 0, 30), drive, LOST), lost])
    assert found is not None
    assert found.joint == (0, 1)
    assert [s.component for s in found.submaps] == [0, 0]
    x, y, turn = se2.between(frame, found.submaps[1].pose)
    assert np.hypot(x, y) < 0.2 and abs(turn) < 0.05


def test_a_fragment_that_is_older_gives_the_component_its_number(
    drive: tuple[list[Observation], FloatArray],
) -> None:
    frame = random_pose(np.random.default_rng(3))
    lost, seen = fragment(drive, LOST, 2, frame)
    older = Submap(0, 0, np.zeros(3), lost.map, lost.trajectory)
    whole = mapped(part(BUILDING, 0, 30), drive, LOST)
    younger = Submap(1, 1, whole.pose, whole.map, whole.trajectory)
    finder = FragmentFinder()
    finder.note(older, seen)
    found = finder.take_up([older, younger])
    assert found is not None
    assert found.joint == (0, 1)
    assert [s.component for s in found.submaps] == [0, 0]
    x, y, turn = se2.between(se2.inverse(frame), found.submaps[1].pose)
    assert np.hypot(x, y) < 0.2 and abs(turn) < 0.05


def test_of_two_places_that_look_alike_it_is_at_the_one_that_the_robot_can_have_come_to(
    drive: tuple[list[Observation], FloatArray],
) -> None:
    there = part(BUILDING, 0, 30)
    both = LineMap.union([there, there.moved(np.array([60.0, 0.0, 0.0]))])
    lost, seen = fragment(drive, LOST, 1, se2.IDENTITY)
    finder = FragmentFinder()
    finder.note(lost, seen)
    found = finder.take_up([mapped(both, drive, LOST), lost])
    assert found is not None
    assert np.hypot(*found.submaps[1].pose[:2]) < 0.2


def test_it_is_not_taken_up_where_the_robot_cannot_have_come_to(
    drive: tuple[list[Observation], FloatArray],
) -> None:
    lost, seen = fragment(drive, LOST, 1, se2.IDENTITY)
    away = part(BUILDING, 0, 30).moved(np.array([8.0, 0.0, 0.0]))
    finder = FragmentFinder()
    finder.note(lost, seen)
    assert finder.take_up([mapped(away, drive, LOST), lost]) is None


def test_it_is_asked_again_once_more_is_mapped_there(
    drive: tuple[list[Observation], FloatArray], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each look takes some hundredths of a second; a robot that is lost often has many to take."""
    asked: list[int] = []

    def refuse(_: FragmentFinder, __: object, number: int, *___: object) -> None:
        asked.append(number)

    monkeypatch.setattr(FragmentFinder, "_found", refuse)
    lost, seen = fragment(drive, LOST, 1, se2.IDENTITY)
    finder = FragmentFinder()
    finder.note(lost, seen)
    for until, count in ((LOST - 20, 1), (LOST - 20, 1), (LOST - 19, 1), (LOST, 2)):
        finder.take_up([mapped(part(BUILDING, 0, 30), drive, until), lost])
        assert len(asked) == count


def test_no_more_scans_are_kept_than_agreed(
    drive: tuple[list[Observation], FloatArray],
) -> None:
    finder = FragmentFinder(FragmentParameters(kept=2, probes=2))
    for number in range(5):
        lost, seen = fragment(drive, LOST, 4, se2.IDENTITY)
        finder.note(Submap(number, number, lost.pose, lost.map, lost.trajectory), seen)
    assert [(k, len(each.scans)) for k, each in finder._waiting.items()] == [(3, 2), (4, 2)]
