"""Subscribers that come before, while and after robots map, and one that sleeps for a minute."""

from pathlib import Path

import pytest

from benchmarks.faults.subscribers import HISTORY, try_out


@pytest.mark.slow
def test_each_gets_the_latest_of_a_long_history_and_every_version_after_it_in_order(
    tmp_path: Path,
) -> None:
    subscribers, published = try_out(tmp_path)
    assert [each.name for each in subscribers] == ["before", "during", "asleep", "after"]
    for each in subscribers:
        assert each.is_in_order
        assert each.delivered[-1][0] == max(published) > HISTORY
    before, during, asleep, after = (each.delivered[0][0] for each in subscribers)
    assert before == asleep == HISTORY
    assert HISTORY < during <= after
