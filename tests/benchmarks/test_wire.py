"""Bytes are counted by the minute in which most were sent."""

import pytest

from benchmarks.wire import busiest_minute


def test_the_busiest_minute_begins_anywhere_and_what_is_a_minute_later_is_not_of_it() -> None:
    sent = [(0.0, 600), (50.0, 1200), (109.0, 600), (110.5, 6000), (300.0, 60)]
    assert busiest_minute(sent) == pytest.approx((600 + 6000) / 60)
    assert busiest_minute(sent[:3]) == pytest.approx(1800 / 60)
    assert busiest_minute([]) == 0.0
