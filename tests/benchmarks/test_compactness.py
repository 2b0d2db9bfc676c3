"""What counts as doubled, as a sliver and as meeting."""

import numpy as np
import pytest

from tests.benchmarks.compactness import compactness

WALL = [0.0, 0.0, 4.0, 0.0]


def doubled(*others: list[float]) -> float:
    return compactness(np.array([WALL, *others])).doubled


@pytest.mark.parametrize(
    ("other", "share"),
    [
        ([0.0, 0.1, 4.0, 0.1], 1.0),
        ([0.0, -0.25, 4.0, -0.25], 1.0),
        ([2.0, 0.1, 4.0, 0.1], 4 / 6),  # half of the wall, all of the other
        ([0.0, 0.01, 4.0, 0.01], 0.0),  # within the noise
        ([0.0, 0.4, 4.0, 0.4], 0.0),  # another wall
        ([4.0, 0.1, 0.0, 0.1], 0.0),  # the opposite face
        ([4.1, 0.1, 8.0, 0.1], 0.0),  # goes on, displaced
        ([2.0, 0.1, 2.0, 3.0], 0.0),  # across
    ],
)
def test_doubled_is_what_has_the_same_face_close_before_or_behind(
    other: list[float], share: float
) -> None:
    assert doubled(other) == pytest.approx(share, abs=0.02)


def test_slivers_and_meeting_ends_are_counted() -> None:
    found = compactness(np.array([WALL, [4.0, 0.0, 4.0, 0.2], [9.0, 9.0, 12.0, 9.0]]))
    assert (found.segments, found.slivers) == (3, 1)
    assert found.meeting == pytest.approx(2 / 6)
    assert found.length == pytest.approx(7.2)
