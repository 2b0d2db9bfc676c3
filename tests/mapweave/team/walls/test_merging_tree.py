"""Walls are merged where they meet, and only on the way from what changed to the root."""

import numpy as np
import pytest
from numpy.random import Generator

from mapweave.geometry.arrays import FloatArray
from mapweave.lines.merging import Evolution, MergingParameters, evolve
from mapweave.team.recent import Recent
from mapweave.team.walls import merging_tree
from mapweave.team.walls.merging_tree import KnownMergings, Walls, merge_all

P = MergingParameters()


def corridor(rooms: int, noise: float = 0.0) -> tuple[list[Walls], FloatArray]:
    """Return a wall of each of so many rooms in a row, 4 m from each other, and their places."""
    x = 4.0 * np.arange(rooms)
    walls = [Walls(np.array([[at - 2.3, noise, at + 2.3, noise]]), np.array([4.6])) for at in x]
    return walls, np.column_stack([x, np.zeros(rooms)])


@pytest.fixture(name="merged")
def merged_fixture(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """How many segments each merging was of, as they are made."""
    made: list[int] = []

    def noted(
        segments: FloatArray, weights: FloatArray, p: MergingParameters, settled: int
    ) -> Evolution:
        made.append(len(segments))
        return evolve(segments, weights, p, settled)

    monkeypatch.setattr(merging_tree, "evolve", noted)
    return made


def test_walls_that_continue_each_other_become_one() -> None:
    walls, places = corridor(37)
    found = merge_all(walls, places, P, Recent())
    np.testing.assert_allclose(found.segments, [[-2.3, 0, 4 * 36 + 2.3, 0]], atol=1e-9)
    np.testing.assert_allclose(found.weights, [37 * 4.6])


@pytest.mark.parametrize("changed", ["moved", "added", "removed"])
def test_what_changes_is_merged_anew_on_its_way_to_the_root_alone(
    changed: str, merged: list[int]
) -> None:
    walls, places = corridor(200)
    known: KnownMergings = Recent()
    merge_all(walls, places, P, known)
    assert len(merged) == 199
    merged.clear()
    known.turn()
    other, place = corridor(1, noise=0.02)
    kept = np.arange(200) != 77
    walls = [wall for wall, stays in zip(walls, kept, strict=True) if stays or changed == "added"]
    places = places if changed == "added" else places[kept]
    if changed != "removed":
        walls, places = [*walls, *other], np.vstack([places, place + np.array([77 * 4.0, 0.0])])
    merge_all(walls, places, P, known)
    assert 1 <= len(merged) <= 11


def test_it_does_not_matter_in_which_order_walls_of_different_places_come(rng: Generator) -> None:
    walls, places = corridor(50)
    order = rng.permutation(50)
    one = merge_all(walls, places, P, Recent())
    other = merge_all([walls[k] for k in order], places[order], P, Recent())
    np.testing.assert_array_equal(one.segments, other.segments)


def test_walls_of_one_place_are_merged_too() -> None:
    walls, _ = corridor(1)
    found = merge_all(walls * 9, np.full((9, 2), 1e12), P, Recent())
    np.testing.assert_allclose(found.segments, walls[0].segments)


def test_segments_that_are_settled_are_not_merged_among_themselves() -> None:
    pair = np.array([[0.0, 0, 3, 0], [0, 0.01, 3, 0.01]])
    far = np.array([[50.0, 0, 53, 0]])
    assert len(evolve(np.vstack([pair, far]), parameters=P, settled=2).segments) == 3
    assert len(evolve(np.vstack([pair, pair]), parameters=P, settled=2).segments) == 1
