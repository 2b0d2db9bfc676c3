"""The grid finds every segment in reach."""

import numpy as np
import pytest

from mapweave.arrays import FloatArray
from mapweave.merging_cost import Pairs, proximity
from mapweave.segment_grid import SegmentGrid


def some_segments(seed: int) -> FloatArray:
    random = np.random.default_rng(seed)
    start = random.uniform(-5, 5, (150, 2))
    return np.hstack([start, start + random.normal(0, 1, (150, 2))])


@pytest.mark.parametrize("reach", [0.1, 0.3, 1.0])
def test_no_segment_in_reach_is_missed(reach: float) -> None:
    segments = some_segments(1)
    grid = SegmentGrid(reach)
    for number, segment in enumerate(segments):
        grid.add(number, segment)
    for segment in segments:
        apart = proximity(Pairs.of(segment[None], segments))
        assert set(np.flatnonzero(apart <= reach)) <= set(grid.near(segment).tolist())


def test_far_segments_are_left_out() -> None:
    grid = SegmentGrid(0.3)
    grid.add(0, np.array([0.0, 0, 5, 0]))
    grid.add(1, np.array([0.0, 50, 5, 50]))
    assert grid.near(np.array([1.0, 0.1, 2, 0.1])).tolist() == [0]


def test_removed_segments_are_not_found() -> None:
    grid = SegmentGrid(0.3)
    segment = np.array([0.0, 0, 5, 0])
    grid.add(0, segment)
    grid.add(1, segment)
    grid.remove(0)
    assert grid.near(segment).tolist() == [1]
