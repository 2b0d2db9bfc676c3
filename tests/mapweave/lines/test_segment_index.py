"""The grid finds every segment in reach."""

import numpy as np
import pytest
import shapely

from mapweave.lines.segment_index import SegmentIndex


@pytest.mark.parametrize("reach", [0.1, 0.3, 1.0])
def test_no_segment_in_reach_is_missed(reach: float) -> None:
    random = np.random.default_rng(1)
    start = random.uniform(-9, 9, (800, 2))
    segments = np.hstack([start, start + random.normal(0, 2 * reach, (800, 2))])
    lines = shapely.linestrings(segments.reshape(-1, 2, 2))
    grid = SegmentIndex(reach)
    for number, segment in enumerate(segments):
        grid.add(number, segment)
    for segment, line in zip(segments, lines, strict=True):
        in_reach = np.flatnonzero(shapely.distance(line, lines) <= reach)
        assert set(in_reach.tolist()) <= set(grid.near(segment).tolist())


def test_an_end_half_way_between_the_points_of_a_segment_is_found_wherever_they_lie() -> None:
    """The worst case: no end of the one is near an end of the other."""
    diagonal = np.array([0, 0, 1, 1]) * np.sqrt(2)
    beside = np.array([1, 0, 3, -1]) * np.sqrt(2)
    for place in np.random.default_rng(2).uniform(-4, 4, (200, 2)):
        shift = np.tile(place, 2)
        grid = SegmentIndex(reach=1.001)
        grid.add(0, diagonal + shift)
        assert grid.near(beside + shift).tolist() == [0]


def test_far_segments_are_left_out() -> None:
    grid = SegmentIndex(0.3)
    grid.add(0, np.array([0.0, 0, 5, 0]))
    grid.add(1, np.array([0.0, 50, 5, 50]))
    assert grid.near(np.array([1.0, 0.1, 2, 0.1])).tolist() == [0]


def test_removed_segments_are_not_found() -> None:
    grid = SegmentIndex(0.3)
    segment = np.array([0.0, 0, 5, 0])
    grid.add(0, segment)
    grid.add(1, segment)
    grid.remove(0)
    assert grid.near(segment).tolist() == [1]
