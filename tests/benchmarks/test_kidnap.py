"""The kidnapping benchmark judges by where each scan was first mapped."""

from collections.abc import Sequence

import numpy as np
import pytest

from benchmarks.kidnap import (
    LENGTH,
    Trial,
    after_the_jump,
    draw,
    off_first_place,
    tell,
    whereabouts,
)
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.maps import LineMap, RobotMap, Submap, Trajectory
from mapweave.scan.scan import Scan

SCANS = 400


def submap(number: int, component: int, index: Sequence[int], pose: FloatArray) -> Submap:
    trajectory = Trajectory(np.array(index), np.array(index, dtype=float), pose)
    return Submap(number, component, np.array([3.0, 1.0, 0.5]), LineMap.empty(), trajectory)


def line_of(count: int) -> FloatArray:
    """(count, 3) poses half a metre apart, along x."""
    return np.column_stack([np.arange(count) * 0.5, np.zeros((count, 2))])


def kidnapped(start: int, component: int, shift: FloatArray) -> RobotMap:
    """Return a map of 240 scans and, moved by `shift`, 100 of them once more."""
    first = line_of(240)
    again = se2.compose(first[start : start + LENGTH], shift)
    after = range(SCANS + start, SCANS + start + LENGTH)
    submaps = submap(0, 0, range(240), first), submap(1, component, after, again)
    return RobotMap("r1", "0", 1, submaps)


def test_a_scan_that_is_back_is_off_by_its_distance_from_where_it_was_first_mapped() -> None:
    where = whereabouts(kidnapped(30, 0, np.array([0.3, 0.4, -0.2])))
    errors = off_first_place(where, SCANS, 30)
    assert [index for index, _, _ in errors] == list(range(30, 130))
    np.testing.assert_allclose([error[1:] for error in errors], [[0.5, 0.2]] * LENGTH)


def test_a_scan_in_another_component_is_not_back() -> None:
    assert off_first_place(whereabouts(kidnapped(30, 1, np.zeros(3))), SCANS, 30) == []


def test_the_jump_is_farther_than_a_step_and_the_same_for_the_same_number() -> None:
    first_part = RobotMap("r1", "0", 1, (submap(0, 0, range(240), line_of(240)),))
    starts = [draw(first_part, SCANS, number) for number in range(20)]
    assert starts == [draw(first_part, SCANS, number) for number in range(20)]
    assert len(set(starts)) > 10
    for start, jump in starts:
        assert 0 <= start < SCANS / 2 - LENGTH
        assert jump == pytest.approx(0.5 * (239 - start))


def test_nothing_in_the_scans_tells_of_the_jump() -> None:
    """Indices ascend and none is used twice; time goes on."""
    scans = [Scan(np.array([1.0]), np.array([0.0]), k, 0.1 * k) for k in range(SCANS)]
    after = list(after_the_jump(scans, 50))
    assert [scan.index for scan in after] == list(range(SCANS + 50, SCANS + 150))
    assert after[0].stamp == pytest.approx(scans[239].stamp)
    np.testing.assert_allclose(np.diff([scan.stamp for scan in after]), 0.1)


def trial(back: int, longest: int, lost_after: int | None) -> Trial:
    return Trial("log", 0, 0, 9.0, True, lost_after, 100, back, 100, longest, longest, 0.1, 0.2, 5)


@pytest.mark.parametrize(
    ("back", "longest", "lost_after", "said", "rejoined", "wrong"),
    [
        (100, 0, 5, True, True, False),
        (100, 4, 6, False, True, False),
        (100, 100, None, False, False, True),
        (10, 0, 5, True, False, False),
    ],
)
def test_a_robot_rejoined_when_most_scans_are_back_and_no_run_of_them_is_misplaced(
    *, back: int, longest: int, lost_after: int | None, said: bool, rejoined: bool, wrong: bool
) -> None:
    judged = trial(back, longest, lost_after)
    assert (judged.said_lost, judged.rejoined, judged.wrong) == (said, rejoined, wrong)


def test_the_table_tells_of_a_log_where_no_robot_rejoined() -> None:
    told = tell([trial(0, 0, 5)]).splitlines()[1]
    assert " ".join(told.split()) == "log 1 1 1 0 0 0 - -"
