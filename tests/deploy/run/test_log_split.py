"""Stretches of a log."""

from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st

from mapweave_deploy.run.log_split import OVERLAP, cut


@given(robots=st.integers(1, 12), scans=st.integers(12, 5000))
def test_stretches_cover_the_log_in_order(robots: int, scans: int) -> None:
    stretches = cut(scans, robots)
    assert len(stretches) == robots
    assert stretches[0][0] == 0
    assert stretches[-1][1] == scans
    assert all(0 <= first < behind <= scans for first, behind in stretches)
    assert stretches == sorted(stretches)


@given(robots=st.integers(2, 12), scans=st.integers(120, 5000))
def test_neighbours_share_twice_the_overlap(robots: int, scans: int) -> None:
    stretches = cut(scans, robots)
    for (_, end), (start, _) in pairwise(stretches):
        assert abs((end - start) - 2 * OVERLAP * scans / robots) <= 2


def test_one_robot_gets_the_whole_log() -> None:
    assert cut(100, 1) == [(0, 100)]
