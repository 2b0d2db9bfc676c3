"""What the index of shapes is held against."""

import pytest

from benchmarks.shape import against_bars, without_words


def rows(found: int, missed: int, milliseconds: float) -> list[dict[str, object]]:
    rank = [0] * found + [None] * missed
    return [{"rank": r, "milliseconds": milliseconds} for r in rank]


def test_an_index_falls_short_where_it_finds_too_few_or_takes_too_long() -> None:
    assert not against_bars(rows(95, 5, 1.9), 1000)[1]
    assert against_bars(rows(94, 6, 1.9), 1000)[1]
    assert against_bars(rows(95, 5, 2.1), 1000)[1]


def test_a_query_may_take_longer_among_more_submaps() -> None:
    assert not against_bars(rows(95, 5, 3.9), 10_000)[1]
    assert against_bars(rows(95, 5, 4.1), 10_000)[1]


@pytest.mark.parametrize(("took", "share"), [(1.0, "1.0%"), (0.1, "1.0%"), (50.0, "50.0%")])
def test_without_words_as_much_is_found_as_can_be_looked_at_in_that_time(
    took: float, share: str
) -> None:
    """A hundred submaps, of which one is the right one; a millisecond for each."""
    row: dict[str, object] = {"milliseconds": took, "right": 1, "submaps": 100}
    assert f" {share} at most" in without_words([row, row], 1.0)
