"""Arrays are taken as a caller has them, and refused by their name where they are none."""

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import ArrayLike

from mapweave.errors import ArgumentError, MapweaveError
from mapweave.geometry.arguments import (
    as_list,
    as_number,
    as_numbers,
    as_positive,
    as_segments,
    as_values,
    check_kind,
)
from mapweave.geometry.arrays import FloatArray


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
        ([[0, 0, 1, 1e300]], r"walls: expected coordinates within 1e\+09 m, got 1e\+300"),
        (np.ones((1, 4)) + 1j, r"walls: expected \(n, 4\) segments .* of type complex128"),
        (np.zeros((1, 4), "M8[s]"), r"walls: expected \(n, 4\) segments .* of type datetime64"),
        ([[0, 0, 1, 10**400]], r"walls: expected \(n, 4\) segments"),
        ((each for each in [[0, 0, 1, 1]]), r"walls: expected \(n, 4\) segments .* got generator"),
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


@pytest.mark.parametrize("value", [0.0, -1.0, np.nan, np.inf, "far", None, [1.0], 1j])
def test_a_length_is_above_zero(value: float) -> None:
    with pytest.raises(ArgumentError, match=r"^max_gap: expected more than 0 m"):
        as_positive("max_gap", value, "m")
    assert as_positive("max_gap", 2, "m") == 2.0


def test_what_a_mask_hides_is_no_number() -> None:
    hidden = np.ma.masked_array([1, 2, 3], mask=[False, True, False])
    np.testing.assert_array_equal(as_numbers("ranges", hidden, "expected some"), [1, np.nan, 3])


@pytest.mark.parametrize(
    "lay",
    [
        np.asfortranarray,
        lambda given: given.astype(np.float32),
        lambda given: given.astype(np.int8),
        lambda given: given.astype(">f8"),
        lambda given: given.astype(object),
        lambda given: np.repeat(given, 2, axis=0)[::2],
        lambda given: given.tolist(),
    ],
)
def test_numbers_are_the_same_however_they_lie_in_memory(
    lay: Callable[[FloatArray], ArrayLike],
) -> None:
    given = np.array([[0.0, 1, 2, 3], [4, 5, 6, 7]])
    found = as_segments("walls", lay(given))
    assert found.dtype == np.float64
    np.testing.assert_array_equal(found, given)


@pytest.mark.parametrize("value", [np.nan, [1.0, 2.0], "1 m", None])
def test_one_number_is_one(value: ArrayLike) -> None:
    with pytest.raises(ArgumentError, match=r"^range_max: expected a distance"):
        as_number("range_max", value, "expected a distance [m]")
    assert as_number("range_max", np.inf, "expected a distance [m]") == np.inf


def test_what_is_of_another_kind_is_refused_by_name() -> None:
    check_kind("some", 3, str, int)
    with pytest.raises(ArgumentError, match=r"^some: expected str or int, got float"):
        check_kind("some", 3.0, str, int)


def test_a_list_is_also_what_can_be_gone_through_once() -> None:
    assert as_list("names", (name for name in "ab"), str) == ["a", "b"]
    with pytest.raises(ArgumentError, match=r"^names: expected str, got int"):
        as_list("names", ["a", 3], str)
    with pytest.raises(ArgumentError, match=r"^numbers: expected a list of int, got int"):
        as_list("numbers", 3, int)  # type: ignore[arg-type]
