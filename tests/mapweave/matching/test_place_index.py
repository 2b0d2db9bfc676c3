"""One index of shapes: a map is found in others by its words, and by what both saw."""

import numpy as np
import pytest

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.maps import LineMap
from mapweave.matching.place_index import Place, PlaceIndex, PlaceIndexParameters
from tests.mapweave.buildings import BUILDING, OTHER_BUILDING, part, shaken

MOTION = np.array([7.0, -4.0, 2.2])


def moved(lines: LineMap) -> LineMap:
    return shaken(lines, np.random.default_rng(2)).moved(se2.inverse(MOTION))


def filled() -> PlaceIndex[str]:
    index: PlaceIndex[str] = PlaceIndex()
    for name, building in (("one", BUILDING), ("other", OTHER_BUILDING)):
        for k, left in enumerate((0.0, 8.0, 16.0)):
            index.add(f"{name}/{k}", index.prepare(part(building, left, left + 12.0)), name)
    return index


def error(transform: FloatArray) -> tuple[float, float]:
    """How far off at the middle of the first 20 m of the building [m], [rad]."""
    middle = se2.transform_points(se2.inverse(MOTION), np.array([12.0, 1.0]))
    apart = se2.transform_points(transform, middle) - (12.0, 1.0)
    return float(np.hypot(*apart)), float(np.abs(se2.wrap(transform[2] - MOTION[2])))


def test_a_map_is_found_where_it_is() -> None:
    index = filled()
    found = index.query(index.prepare(moved(part(BUILDING, 6.0, 18.0))))
    assert found[0].key in ("one/0", "one/1")
    distance, turn = error(found[0].transform)
    assert distance < 0.5
    assert turn < np.radians(5)
    assert found[0].score > 5.0


def test_maps_of_one_owner_are_left_out() -> None:
    index = filled()
    shape = index.prepare(moved(part(BUILDING, 6.0, 18.0)))
    assert any(place.key.startswith("one") for place in index.query(shape, but="nobody"))
    found = index.query(shape, but="one")
    assert found
    assert all(place.key.startswith("other") for place in found)


def test_more_maps_than_there_was_room_for_are_all_found() -> None:
    index: PlaceIndex[int] = PlaceIndex()
    shape = index.prepare(part(BUILDING, 0.0, 12.0))
    for k in range(150):
        index.add(k, shape, k % 2)
    assert {place.key for place in index.query(shape, 150, but=0)} <= set(range(1, 150, 2))
    assert index.query(shape, 150, but=0)


def test_a_map_that_is_forgotten_or_replaced_is_found_no_more() -> None:
    index = filled()
    shape = index.prepare(moved(part(BUILDING, 0.0, 12.0)))
    assert "one/0" in [place.key for place in index.query(shape)]
    index.discard("one/0")
    index.discard("never there")
    assert "one/0" not in index
    assert "one/0" not in [place.key for place in index.query(shape)]
    index.add("other/0", shape)
    assert len(index) == 5
    assert index.query(shape, count=1)[0].key == "other/0"


def test_an_empty_index_knows_no_place() -> None:
    index: PlaceIndex[int] = PlaceIndex()
    assert index.query(index.prepare(part(BUILDING, 0.0, 12.0))) == []


def test_what_is_free_in_one_and_wall_in_the_other_speaks_against_a_place() -> None:
    index: PlaceIndex[int] = PlaceIndex()
    lines = part(BUILDING, 0.0, 12.0)
    index.add(0, index.prepare(lines))
    crossed = LineMap(
        np.vstack([lines.segments, [[5.0, 0.3, 5.0, 1.9], [6.0, 1.9, 6.0, 0.3]]]),
        np.append(lines.polyline, [1000, 1001]),
        np.append(lines.support, [5, 5]),
        lines.free_space,
    )
    same, other = (index.query(index.prepare(m))[0].score for m in (lines, crossed))
    assert other < same - 2.0


@pytest.mark.parametrize("pure", ["0", "1"])
def test_places_are_found_with_and_without_compiled_kernels(
    pure: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    if pure == "1":
        for module in ("place_views", "shape_index"):
            monkeypatch.setattr(f"mapweave.kernels.matching.{module}.COMPILED", None)
    index = filled()
    found = index.query(index.prepare(moved(part(BUILDING, 6.0, 18.0))), count=1)
    assert error(found[0].transform)[0] < 0.5


def looked_up(usual: int, budget: int, voted: int) -> list[Place[int]]:
    """Look a map up among eight; all that is voted is scored."""
    said = {"usual": usual, "growth": 0.5, "budget": budget, "voted": voted, "scored": 1000}
    index: PlaceIndex[int] = PlaceIndex(PlaceIndexParameters().model_copy(update=said))
    for k in range(8):
        index.add(k, index.prepare(part(BUILDING, 2.0 * k, 2.0 * k + 12.0)))
    return index.query(index.prepare(moved(part(BUILDING, 6.0, 18.0))), 1000)


def test_among_more_maps_more_words_and_places_are_looked_at() -> None:
    of_eight, of_two = looked_up(8, 1000, 30), looked_up(2, 500, 15)
    assert len(of_two) == len(of_eight) == 30
    assert [place.votes for place in of_two] == [place.votes for place in of_eight]
    assert len(looked_up(8, 1000, 15)) == 15
    fewer_words = looked_up(8, 500, 30)
    assert [place.votes for place in fewer_words] != [place.votes for place in of_eight]
