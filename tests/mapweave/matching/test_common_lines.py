"""One corner is like every other: lines that maps share are counted, not only metres."""

import numpy as np
import pytest

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.matching.common_lines import count_common_lines
from mapweave.matching.distance_field import DistanceField, DistanceFieldParameters
from mapweave.matching.verification import VerificationParameters
from tests.mapweave.buildings import line_map

CORNER = [[0.0, 0, 6, 0], [6, 0, 6, 5]]


@pytest.mark.parametrize(
    ("more", "count"),
    [
        ([], 2),
        ([[6.0, 5, 1, 5]], 3),
        ([[8.0, 0, 9, 0]], 2),  # on one line with a wall that is there
        ([[1.0, 0.02, 0, 0.02]], 3),  # the other side of it
        ([[3.0, 3, 3.3, 3]], 2),  # too short to be a line
    ],
)
def test_walls_on_one_line_count_once(more: list[list[float]], count: int) -> None:
    lines = line_map(np.array([*CORNER, *more]))
    turned: FloatArray = np.array([2.0, -1.0, 0.7])
    there = line_map(se2.transform_segments(turned, lines.segments))
    p = DistanceFieldParameters()
    known, seen = DistanceField.of(there, p), DistanceField.of(lines, p)
    assert count_common_lines(known, seen, turned, lines, VerificationParameters()) == count
