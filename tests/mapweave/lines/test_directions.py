"""Main directions are the significant peaks of the direction histogram (paper, VI-A)."""

import numpy as np
import pytest
import scipy.signal
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import ArrayLike

from mapweave.errors import ArgumentError
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.kernels.lines.main_directions import DirectionRules, _significant_peaks
from mapweave.lines.directions import (
    DIRECTED_PERIOD,
    LINE_PERIOD,
    direction_histogram,
    likely_turns,
    line_difference,
    main_directions,
    mirrored_turns,
    nearest_direction,
    turn_histogram,
)
from tests.mapweave.buildings import BUILDING, part


def walls(degrees: FloatArray, length: float = 1.0) -> FloatArray:
    """Return segments of the given directions, all from the origin."""
    angle = np.deg2rad(degrees)
    ends = length * np.column_stack([np.cos(angle), np.sin(angle)])
    return np.hstack([np.zeros_like(ends), ends])


def building(seed: int, *turns: float) -> FloatArray:
    """Return walls of rectangular wings turned by `turns` [degrees], with 1° of noise."""
    random = np.random.default_rng(seed)
    directions = np.concatenate([turn + 90 * random.integers(0, 4, 80) for turn in turns])
    return walls(directions + random.normal(0, 1, len(directions)))


def test_the_histogram_holds_each_segment_by_its_length() -> None:
    segments = np.concatenate([walls(np.array([20.0]), 3.0), walls(np.array([110.0]), 1.0)])
    histogram = direction_histogram(segments)
    assert histogram.sum() == pytest.approx(4.0)
    assert histogram[15:26].sum() == pytest.approx(3.0, rel=1e-3)
    assert histogram[105:116].sum() == pytest.approx(1.0, rel=1e-3)


def test_weights_stand_in_for_lengths() -> None:
    segments = walls(np.array([20.0, 110.0]))
    histogram = direction_histogram(segments, np.array([1.0, 5.0]))
    assert histogram.sum() == pytest.approx(6.0)
    assert np.argmax(histogram) == 110


def test_both_faces_of_a_wall_count_for_one_line_but_for_two_directions() -> None:
    faces = walls(np.array([30.0, 210.0]))
    lines = direction_histogram(faces, bins=180, period=LINE_PERIOD)
    directed = direction_histogram(faces, bins=360, period=DIRECTED_PERIOD)
    assert np.argmax(lines) == 30
    assert lines[20:41].sum() == pytest.approx(2.0, rel=1e-3)
    assert directed[20:41].sum() == pytest.approx(1.0, rel=1e-3)
    assert directed[200:221].sum() == pytest.approx(1.0, rel=1e-3)


def test_the_histogram_is_circular() -> None:
    histogram = direction_histogram(walls(np.array([179.9, 0.1])))
    assert np.argmax(histogram) == 0
    assert histogram[1] == pytest.approx(histogram[-1])


def test_turning_the_building_turns_the_histogram() -> None:
    segments = building(1, 10.0)
    turned = se2.transform_segments([3.0, -2.0, np.deg2rad(25.0)], segments)
    directed = direction_histogram(segments, bins=360, period=DIRECTED_PERIOD)
    shifted = direction_histogram(turned, bins=360, period=DIRECTED_PERIOD)
    np.testing.assert_allclose(shifted, np.roll(directed, 25), atol=0.5)


def test_round_walls_have_no_main_direction() -> None:
    assert len(main_directions(walls(np.arange(0.0, 360.0, 3.0)))) == 0


@pytest.mark.parametrize("seed", range(5))
def test_chance_makes_no_main_direction(seed: int) -> None:
    """300 walls in any direction: the histogram has many peaks, none of them significant."""
    anywhere = np.random.default_rng(seed).uniform(0, 360, 300)
    assert len(main_directions(walls(anywhere))) == 0


def test_nothing_has_no_main_direction() -> None:
    assert len(main_directions(np.empty((0, 4)))) == 0


def test_two_wings_at_30_degrees_have_four_main_directions() -> None:
    found = np.rad2deg(main_directions(building(2, 0.0, 30.0)))
    expected = np.array([0.0, 30.0, 90.0, 120.0])
    assert len(found) == len(expected)
    error = np.rad2deg(line_difference(np.deg2rad(found[:, None]), np.deg2rad(expected)))
    assert (np.abs(error).min(axis=0) < 0.5).all()


def test_a_main_direction_is_found_between_the_bins() -> None:
    found = main_directions(walls(np.array([40.3, 40.5, 130.4])))
    np.testing.assert_allclose(np.rad2deg(found), [40.4, 130.4], atol=1e-6)


def test_main_directions_lie_in_the_half_circle() -> None:
    found = main_directions(walls(np.array([-0.4, 0.1, 0.2])))
    assert (found >= 0).all()
    assert (found < np.pi).all()


def test_main_directions_turn_with_the_building() -> None:
    segments = building(3, 5.0, 50.0)
    before = main_directions(segments)
    random = np.random.default_rng(3)
    for motion in random.uniform(-3, 3, (5, 3)):
        after = main_directions(se2.transform_segments(motion, segments))
        assert len(after) == len(before)
        error = line_difference(after[:, None], before + motion[2])
        assert (np.abs(error).min(axis=0) < np.deg2rad(0.3)).all()


def test_drift_makes_no_direction_of_its_own() -> None:
    """Accumulated errors spread a direction; they do not lead to a peak (paper, VI)."""
    drifting = walls(np.concatenate([np.linspace(0, 4, 60), 90 + np.linspace(0, 4, 60)]))
    assert len(main_directions(drifting)) == 2


@pytest.mark.parametrize(("beside", "count"), [(5.0, 1), (20.0, 2)])
def test_a_shoulder_of_a_main_direction_is_none_of_its_own(beside: float, count: int) -> None:
    """Half the wall, 5° beside: no valley parts the two; 20° beside one does."""
    turned = np.concatenate([walls(np.array([0.0]), 10.0), walls(np.array([beside]), 5.0)])
    assert len(main_directions(turned)) == count


def test_the_nearest_direction_is_that_of_a_line() -> None:
    directions = np.deg2rad([2.0, 92.0])
    found = nearest_direction(np.deg2rad([181.0, -90.0, 45.0]), directions, np.deg2rad(5.0))
    np.testing.assert_allclose(found[:2], directions)
    assert np.isnan(found[2])


def test_no_direction_is_near_when_there_is_none() -> None:
    assert np.isnan(nearest_direction(1.0, np.empty(0), 1.0))


@pytest.mark.parametrize("seed", range(4))
def test_the_true_turn_is_among_the_likely_ones(seed: int) -> None:
    rng = np.random.default_rng(seed)
    turn = rng.uniform(-np.pi, np.pi)
    halves = part(BUILDING, 0, 18).segments, part(BUILDING, 8, 30).segments
    turned = se2.transform_segments(np.array([3.0, -1.0, -turn]), halves[1])
    found = likely_turns(turn_histogram(halves[0]), turn_histogram(turned), 4, 0.17)
    assert np.abs(se2.wrap(found - turn)).min() < np.radians(1.5)
    apart = np.abs(se2.wrap(found[:, None] - found)) + np.pi * np.eye(len(found))
    assert apart.min() > 0.17


def test_of_a_mirrored_map_the_directions_are_told_by_those_of_the_map() -> None:
    """Its walls run the other way: what was on their left is on their right."""
    walls = part(BUILDING, 0, 18).segments
    mirrored = walls[:, [2, 3, 0, 1]] * np.array([1.0, -1.0, 1.0, -1.0])
    told = mirrored_turns(turn_histogram(walls))
    np.testing.assert_allclose(told, turn_histogram(mirrored), atol=1e-9)


def test_visible_sides_tell_half_a_turn_from_none() -> None:
    """Three walls of a room, seen from inside: only one turn lays them on themselves."""
    walls = np.array([[0.0, 0, 6, 0], [6, 0, 6, 4], [0, 4, 0, 0]])
    seen, back = turn_histogram(walls), turn_histogram(walls[:, [2, 3, 0, 1]])
    assert abs(likely_turns(seen, seen, 4, 0.17)[0]) < np.radians(1)
    assert abs(se2.wrap(likely_turns(seen, back, 4, 0.17)[0] - np.pi)) < 0.02


@given(
    st.lists(st.one_of(st.integers(0, 4), st.floats(0, 9)), min_size=3, max_size=60).map(
        lambda values: np.array(values, dtype=float)
    )
)
def test_peaks_and_their_prominences_are_scipys(values: FloatArray) -> None:
    rules = DirectionRules(len(values), 0.05, 0.9, 0.3)
    around = np.tile(values, 3)  # a histogram of directions has no ends
    peaks, found = scipy.signal.find_peaks(around, prominence=0.0)
    high = around[peaks] >= rules.significance * values.mean()
    deep = found["prominences"] >= rules.separation * around[peaks]
    inside = (peaks >= len(values)) & (peaks < 2 * len(values))
    expected = peaks[high & deep & inside] - len(values)
    np.testing.assert_array_equal(_significant_peaks(values, rules), expected)


@pytest.mark.parametrize(
    ("segments", "weights", "complaint"),
    [
        ([[0.0, 0, 1, np.nan]], None, "^segments: expected finite"),
        ([0.0, 0, 1, 1], None, r"^segments: expected \(n, 4\)"),
        ([[0, 0], [1, 0], [1, 1]], [1.0], r"^weights: expected \(2,\)"),
    ],
)
def test_what_is_no_wall_is_refused_by_name(
    segments: ArrayLike, weights: ArrayLike, complaint: str
) -> None:
    with pytest.raises(ArgumentError, match=complaint):
        main_directions(segments, weights)
