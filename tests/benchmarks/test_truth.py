"""What the benchmarks measure by: a wrong yardstick would make every figure wrong."""

from pathlib import Path

import numpy as np
import pytest

from benchmarks.logs import find_logs, load_scans, load_truth
from benchmarks.truth import (
    Path2D,
    false_meetings,
    position_error,
    relation_error,
    steps_right,
)
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray


def _walk(count: int, seed: int = 1) -> FloatArray:
    """Return (count, 3) poses a random step apart each."""
    rng = np.random.default_rng(seed)
    steps = rng.normal(0.0, [0.5, 0.1, 0.3], (count, 3))
    poses = [np.zeros(3)]
    for step in steps[1:]:
        poses.append(se2.compose(poses[-1], step))
    return np.array(poses)


def _path(poses: FloatArray, component: int = 0, first: int = 0) -> Path2D:
    return Path2D(component, np.arange(first, first + len(poses)), poses)


def test_a_rigidly_moved_truth_is_right_in_every_step_and_position() -> None:
    truth = _walk(50)
    moved = _path(se2.compose([3.0, -7.0, 2.0], truth))
    assert steps_right([moved], truth).all()
    assert position_error(moved, truth) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize(
    ("slip", "right"),
    [
        ([0.24, 0.0, 0.0], True),
        ([0.26, 0.0, 0.0], False),
        ([0.0, 0.0, np.radians(4.9)], True),
        ([0.0, 0.0, np.radians(-5.1)], False),
    ],
)
def test_a_step_is_right_up_to_a_quarter_metre_and_five_degrees(
    slip: list[float], right: bool
) -> None:
    truth = _walk(10)
    slipped = truth.copy()
    fifth = se2.compose(truth[5], slip)
    slipped[5:] = se2.compose(fifth, se2.between(truth[5], truth[5:]))
    assert steps_right([_path(slipped)], truth).sum() == 8 + right


def test_steps_between_components_do_not_count() -> None:
    truth = _walk(10)
    parts = [_path(truth[:6]), _path(se2.compose([1.0, 2.0, 3.0], truth[6:]), 1, first=6)]
    right = steps_right(parts, truth)
    assert len(right) == 8
    assert right.all()


def test_a_step_leads_over_scans_whose_truth_is_unknown() -> None:
    truth = _walk(10)
    path = _path(truth.copy())
    truth[4] = np.nan
    assert len(steps_right([path], truth)) == 8


def test_a_map_that_shows_two_places_as_one_has_false_meetings_and_a_true_one_none() -> None:
    """Two parallel corridors of 20 m, 8 m apart; the map lays one on the other."""
    along = np.linspace(0, 20, 41)
    there = np.column_stack([along, np.zeros((41, 2))])
    back = np.column_stack([along[::-1], np.full(41, 8.0), np.full(41, np.pi)])
    truth = np.vstack([there, back, there])
    folded = truth.copy()
    folded[41:82, 1] = 0.5
    moved = se2.compose([5.0, 1.0, 2.0], truth)
    assert false_meetings(_path(moved), truth) == 0
    assert 4 <= false_meetings(_path(folded), truth) <= 30
    assert false_meetings(_path(folded), np.full_like(truth, np.nan)) == 0


@pytest.mark.parametrize(
    ("name", "joined", "metres"), [("fr079", 136, 0.051), ("intel-lab", 515, 0.043)]
)
def test_corrected_poses_score_what_is_published_of_them(
    data_dir: Path, name: str, joined: int, metres: float
) -> None:
    """The relations' join and error are as others compute them."""
    assert data_dir.is_dir()
    (log,) = find_logs([name])
    stamps = np.array([scan.stamp for scan in load_scans(log)])
    assert log.relations is not None
    error = relation_error(log.relations, stamps, [_path(load_truth(log, stamps))])
    assert (error.joined, error.used) == (joined, joined)
    assert error.translation == pytest.approx(metres, abs=0.0005)


def test_scans_of_the_raw_log_get_the_pose_of_the_corrected_one_with_their_stamp(
    data_dir: Path,
) -> None:
    raw, corrected = find_logs(["csail", "csail-thinned"])
    assert data_dir in raw.path.parents
    stamps = np.array([scan.stamp for scan in load_scans(raw)])
    truth = load_truth(raw, stamps)
    known = np.isfinite(truth[:, 0])
    thinned = np.array([scan.stamp for scan in load_scans(corrected)])
    np.testing.assert_array_equal(stamps[known], thinned)
    np.testing.assert_array_equal(truth[known], load_truth(corrected, thinned))
