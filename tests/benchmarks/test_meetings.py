"""An alignment is judged where robots met, by what it says of the place next to them."""

import numpy as np
import pytest

from benchmarks.meetings import meeting_error
from benchmarks.stretches import Part
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.maps import Alignment, LineMap, RobotMap, SharedPlace, Submap, Trajectory
from mapweave.reasons import Reason

FRAME = np.array([3.0, -2.0, 0.7])  # of the second map in the first one
PATH = np.column_stack([np.linspace(0, 50, 51), np.zeros((51, 2))])


def part(path: FloatArray, frame: FloatArray) -> Part:
    seen = se2.compose(se2.inverse(frame), path)
    return Part(frame, 0.0, np.empty((0, 2)), seen, path)


def robot(name: str, frame: FloatArray) -> RobotMap:
    here = [np.zeros(3), np.array([40.0, 0, 0])]
    submaps = (
        Submap(k, 0, se2.compose(se2.inverse(frame), pose), LineMap.empty(), Trajectory.empty())
        for k, pose in enumerate(here)
    )
    return RobotMap(name, "boot", 1, tuple(submaps))


def found(transform: FloatArray, *places: SharedPlace) -> Alignment:
    cause = Reason.words("so")
    return Alignment("a/0", "b/0", transform, "accepted", 0.9, cause, places=places)


MAPS = robot("a", se2.IDENTITY), robot("b", FRAME)
FIRST, SECOND = part(PATH, se2.IDENTITY), part(PATH[40:], FRAME)


def test_what_is_right_is_off_by_nothing_and_what_is_not_by_as_much_as_it_is() -> None:
    assert meeting_error(FIRST, SECOND, MAPS, found(FRAME)) == pytest.approx((0, 0), abs=1e-9)
    shifted = se2.compose([0.3, 0.4, 0.0], FRAME)
    distance, _ = meeting_error(FIRST, SECOND, MAPS, found(shifted))
    assert distance == pytest.approx(0.5)


def test_what_the_nearest_place_says_counts() -> None:
    """The robots met at 40 m to 50 m: there it is off by 0.1 m, at the other end by 3 m."""
    far = SharedPlace(0, 0, np.array([3.0, 0, 0]), np.zeros(2))
    near = SharedPlace(1, 1, np.array([0.1, 0, 0]), np.array([40.0, 0]))
    for places in ((far, near), (near, far)):
        distance, _ = meeting_error(FIRST, SECOND, MAPS, found(FRAME, *places))
        assert distance == pytest.approx(0.1)


def test_only_scans_taken_near_each_other_count() -> None:
    """A turn about where they met leaves them there, whatever it does to the rest of the map."""
    middle = np.array([45.0, 0, 0])
    turned = se2.compose(se2.compose(middle, [0, 0, 0.02]), se2.inverse(middle))
    distance, turn = meeting_error(FIRST, SECOND, MAPS, found(se2.compose(turned, FRAME)))
    assert distance < 0.15
    assert turn == pytest.approx(0.02)


def test_where_no_truth_is_known_nothing_is_said() -> None:
    unknown = Part(FRAME, 0.0, np.empty((0, 2)), SECOND.seen, np.full_like(SECOND.true, np.nan))
    assert np.isnan(meeting_error(FIRST, unknown, MAPS, found(FRAME))).all()
