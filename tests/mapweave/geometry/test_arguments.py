"""Arrays are taken as a caller has them, and refused by their name where they are none."""

import numpy as np
import pytest
from numpy.typing import ArrayLike

from mapweave.errors import ArgumentError, MapweaveError
from mapweave.geometry.arguments import as_positive, as_segments, as_values


def test_vertices_are_the_segments_from_each_to_the_next() -> None:
    segments = as_segments("polyline", [(0, 0), (2, 0), (2, 3)])
    np.testing.assert_array_equal(segments, [[0, 0, 2, 0], [2, 0, 2, 3]])


def test_segments_stay_what_they_are() -> None:
    given = np.array([[0.0, 0, 2, 0], [5, 5, 2, 3]])
    assert as_segments("segments", given) is given


@pytest.mark.parametrize("nothing", [[], np.empty((0, 4)), np.empty((0, 2))])
def test_nothing_is_no_segments(nothing: ArrayLike) -> None:
    assert as_segments("segments", nothing).shape == (0, 4)


@pytest.mark.parametrize(
    ("value", "complaint"),
    [
        (np.zeros((3, 3)), r"walls: expected \(n, 4\) segments .* got shape \(3, 3\)"),
        (np.zeros(4), r"walls: expected \(n, 4\) segments .* got shape \(4,\)"),
        ([[0.0, 0, 1, np.nan]], r"walls: expected finite coordinates \[m\]"),
        ([[0.0, 0, 1, np.inf]], r"walls: expected finite coordinates \[m\]"),
        ([[0, 0]], r"walls: expected two vertices or more, got one"),
        ([[0, 0], [1, 2, 3]], r"walls: expected \(n, 4\) segments .* got list"),
        ("walls", r"walls: expected \(n, 4\) segments .* got str"),
    ],
)
def test_what_is_no_polyline_is_refused_in_one_line_by_name(
    value: ArrayLike, complaint: str
) -> None:
    with pytest.raises(ArgumentError, match=complaint) as refused:
        as_segments("walls", value)
    assert refused.value.argument == "walls"
    assert isinstance(refused.value, MapweaveError)
    assert isinstance(refused.value, ValueError)


@pytest.mark.parametrize("value", [[1.0], [[1.0, 2.0]], [1.0, np.nan], [1.0, np.inf], 3.0])
def test_values_are_finite_and_one_for_each(value: ArrayLike) -> None:
    with pytest.raises(ArgumentError, match=r"^weights: expected"):
        as_values("weights", value, 2, "segment")
    assert as_values("weights", [1, 2], 2, "segment").tolist() == [1.0, 2.0]


@pytest.mark.parametrize("value", [0.0, -1.0, np.nan, np.inf])
def test_a_length_is_above_zero(value: float) -> None:
    with pytest.raises(ArgumentError, match=r"^max_gap: expected more than 0 m"):
        as_positive("max_gap", value, "m")
    assert as_positive("max_gap", 2, "m") == 2.0
