"""Pairs of stretches of different buildings, and what is told of them."""

from benchmarks.across import draw, is_joined, tell

BUILDINGS = ["a", "a", "b", "c", "c", "c"]


def test_every_pair_that_is_drawn_is_of_two_buildings_and_drawn_once() -> None:
    pairs = draw(BUILDINGS, 100, 1)
    assert len(pairs) == len(set(pairs)) == 15 - 1 - 3
    assert all(i < j and BUILDINGS[i] != BUILDINGS[j] for i, j in pairs)


def test_the_same_seed_draws_the_same_pairs_and_more_of_them_goes_on_from_there() -> None:
    assert draw(BUILDINGS, 5, 1) == draw(BUILDINGS, 9, 1)[:5] != draw(BUILDINGS, 5, 2)


def row(*decisions: str) -> dict[str, object]:
    names = {"reference": "a/0", "other": "b/0", "reason": "so it is"}
    return {"alignments": [{"decision": d, "confidence": 0.5, **names} for d in decisions]}


def test_one_component_that_is_joined_makes_a_pair_joined_and_is_named() -> None:
    rows = [row("refused"), row("ambiguous", "accepted"), row()]
    assert [is_joined(each) for each in rows] == [False, True, False]
    told = tell(rows, 10)
    assert told.startswith("3 of 10 pairs across buildings: 1 accepted, 1 refused; 0 over 85%")
    assert "a/0 - b/0: so it is" in told
    assert "3 pairs of components: calibration error 0.500" in told  # none of them can be right
