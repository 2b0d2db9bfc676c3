"""A team of many on a virtual clock: who compares what, and what counts as lost."""

import numpy as np

from benchmarks.scale.command import Figure, Joins, compare_all, figures, lost_by_chance
from benchmarks.scale.driving import Costs, Driven, drive
from benchmarks.scale.made_up import SUBMAPS, robots_of
from benchmarks.scale.members import is_joined_right, made_up
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.maps import Alignment
from mapweave.reasons import Reason, ReasonKind


def alignment(transform: FloatArray) -> Alignment:
    return Alignment("a/0", "b/0", transform, "accepted", 0.99, Reason(ReasonKind.NO_SHAPE))


def test_robots_made_up_are_spread_over_the_buildings() -> None:
    team = list(made_up(3, 7))
    assert len(team) == 7
    assert len({member.building for member in team}) == 3
    assert len({member.robot_map.robot for member in team}) == 7


def test_a_join_is_right_where_the_frames_say_so_and_wrong_across_buildings() -> None:
    one, other, elsewhere = made_up(2, 3)
    if one.building != other.building:
        one, other, elsewhere = other, elsewhere, one
    assert one.frame is not None
    assert other.frame is not None
    true = se2.between(one.frame, other.frame)
    assert is_joined_right(one, other, alignment(true))
    assert not is_joined_right(one, other, alignment(true + np.array([0.0, 0.0, 0.2])))
    assert is_joined_right(one, elsewhere, alignment(true)) is False


def test_a_map_is_sent_when_a_submap_is_finished_and_rivals_are_compared_as_it_grows() -> None:
    team, costs = list(made_up(1, 2)), Costs()
    driven = drive(team, costs)
    assert driven.messages == {0: SUBMAPS, 1: SUBMAPS}
    assert costs.count["a map taken in"] == 2 * SUBMAPS
    assert set(driven.due) <= {(0, 1)}
    assert driven.due[0, 1] <= 2 * SUBMAPS


def test_robots_that_drove_one_corridor_are_proposed_and_joined_rightly() -> None:
    team = list(made_up(1, 4))
    driven, costs = drive(team, Costs()), Costs()
    joins = compare_all(team, driven, costs)
    assert driven.due
    assert joins.found
    assert set(joins.found) <= set(joins.true)
    assert joins.wrong == ()
    assert costs.count["a pair compared"] == len(driven.due)


def test_a_join_that_two_others_tell_is_not_lost() -> None:
    maps, frames = robots_of(0, 3)
    assert len(maps) == len(frames) == 3
    team, driven = list(made_up(1, 3)), Driven()
    chain = Joins(((0, 1), (0, 2), (1, 2)), ((0, 1), (1, 2)), (), 0, (), 0)
    apart = Joins(((0, 1), (0, 2), (1, 2)), ((0, 1),), (), 0, (), 0)
    rows = [
        {row.what: row for row in figures(team, driven, joins)}[
            "joins not found, as two others tell"
        ]
        for joins in (chain, apart)
    ]
    assert [row.count for row in rows] == [0, 1]
    assert [row.short for row in rows] == [False, True]


def test_a_figure_is_short_above_its_share_alone() -> None:
    assert Figure("a", 3, 100, 0.02).short
    assert not Figure("a", 2, 100, 0.02).short
    assert not Figure("a", 99, 100).short


def test_all_pairs_lose_no_join_none_lose_all_and_half_of_them_lose_half() -> None:
    true = [(0, k) for k in range(1, 9)]
    assert lost_by_chance(9, 36, true) == (0, 0)
    assert lost_by_chance(9, 0, true) == (8, 8)
    lost, apart = lost_by_chance(9, 18, true)
    assert 3 <= lost == apart <= 5  # of a star, each join is the only one
    chain = [*true, (1, 2), (2, 3), (3, 4), (5, 6), (6, 7)]
    lost, apart = lost_by_chance(9, 18, chain)
    assert apart < lost
