"""A robot that was lost is not far from where it was before, and after."""

import numpy as np
import pytest

from mapweave.geometry.arrays import FloatArray
from mapweave.mapping.localization.whereabouts import Path, Whereabouts, WhereaboutsParameters
from mapweave.maps import LineMap, Submap, Trajectory


def path(numbers: range, step: float, *, interval: float) -> Path:
    """Return a straight path along x from number 0 on, of `step` [m] and `interval` [s] a scan."""
    index = np.array(numbers)
    poses = np.column_stack([step * index, np.zeros((len(index), 2))])
    trajectory = Trajectory(index, interval * index, poses)
    return Path.of([Submap(0, 0, np.zeros(3), LineMap.empty(), trajectory)], 0)


def lost_at(numbers: range, *, interval: float) -> Path:
    """Return a path that was lost, all of it at its frame's origin."""
    return path(numbers, 0.0, interval=interval)


def allowed(known: Path, lost: Path, at: list[float]) -> list[bool]:
    """Return at which of `at` [m] along x it can have been."""
    where = Whereabouts(lost, known, np.empty(0, dtype=np.int64), WhereaboutsParameters())
    poses: FloatArray = np.column_stack([at, np.zeros((len(at), 2))])
    return [bool(can) for can in where.allows(poses)]


def test_it_came_no_farther_than_its_speed_and_the_time_allow() -> None:
    known, lost = path(range(20), 0.5, interval=0.1), lost_at(range(20, 22), interval=0.1)
    # The last was at 9.5 m, 0.1 s ago: 0.2 m, and 0.6 m for poses that err.
    assert allowed(known, lost, [8.6, 8.8, 10.2, 10.4]) == [False, True, True, False]


@pytest.mark.parametrize("interval", [20.0, np.nan])
def test_it_came_no_farther_than_it_usually_does(interval: float) -> None:
    known, lost = path(range(20), 0.5, interval=interval), lost_at(range(22, 23), interval=interval)
    # Three scans at 1.5 times 0.5 m each from 9.5 m, and 0.6 m.
    assert allowed(known, lost, [12.2, 12.4]) == [True, False]


def test_between_two_scans_that_are_known_it_is_near_both() -> None:
    whole = path(range(40), 0.5, interval=0.1)
    kept = [*range(20), *range(21, 40)]
    known = Path(whole.number[kept], whole.stamp[kept], whole.pose[kept], whole.interval)
    lost = lost_at(range(20, 21), interval=0.1)
    # From 9.5 m, and to 10.5 m: 0.8 m each.
    assert allowed(known, lost, [9.6, 9.8, 10.2, 10.4]) == [False, True, True, False]


def test_what_is_long_ago_tells_nothing() -> None:
    known, lost = path(range(20), 0.5, interval=0.1), lost_at(range(900, 901), interval=0.1)
    assert allowed(known, lost, [9.5]) == [False]
    assert (
        Whereabouts(lost, known, np.empty(0, dtype=np.int64), WhereaboutsParameters()).mapped(known)
        == 0
    )


def test_what_is_mapped_about_there_is_counted() -> None:
    known, lost = path(range(101), 0.5, interval=0.1), lost_at(range(101, 102), interval=0.1)
    assert (
        Whereabouts(lost, known, np.empty(0, dtype=np.int64), WhereaboutsParameters()).mapped(known)
        == 31
    )  # in 15 m


@pytest.mark.parametrize(("others", "unseen"), [([20], True), ([20, 21], False)])
def test_it_went_unseen_where_scans_between_are_in_no_map(others: list[int], unseen: bool) -> None:
    known, lost = path(range(20), 0.5, interval=0.1), lost_at(range(22, 24), interval=0.1)
    mapped = np.concatenate([known.number, lost.number, others])
    assert Whereabouts(lost, known, mapped, WhereaboutsParameters()).went_unseen is unseen
