"""Coarse places: the right one is among few, scored about as it is when it is judged finely."""

import numpy as np
import pytest
from numpy.random import Generator

from mapweave.fusion.mirrored import mirrored
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.maps import LineMap
from mapweave.matching.coarse_places import (
    CoarseMap,
    CoarsePlaceParameters,
    coarse_places,
    most_if_mirrored,
)
from mapweave.matching.distance_field import DistanceField, DistanceFieldParameters
from mapweave.matching.verification import VerificationParameters, verify
from tests.mapweave.buildings import (
    BUILDING,
    OTHER_BUILDING,
    line_map,
    part,
    random_pose,
    rectangle,
    walls_of,
)

P = CoarsePlaceParameters()
JUDGED = VerificationParameters(contradiction_weight=5.0)
LEFT, RIGHT = part(BUILDING, 0, 18), part(BUILDING, 8, 30)


def places(reference: LineMap, other: LineMap) -> tuple[FloatArray, FloatArray]:
    maps = [CoarseMap.of(lines, P, JUDGED) for lines in (reference, other)]
    found = coarse_places(maps[0], maps[1], P, JUDGED)
    return found.aligned, found.scores


def finely(reference: LineMap, other: LineMap, transform: FloatArray) -> float:
    fields = [DistanceField.of(lines, DistanceFieldParameters()) for lines in (reference, other)]
    return verify(fields[0], fields[1], transform, JUDGED).score


def test_the_right_place_counts_most_and_about_as_much_as_it_does_finely(rng: Generator) -> None:
    for pose in [random_pose(rng) for _ in range(5)]:
        there = RIGHT.moved(se2.inverse(pose))
        found, scores = places(LEFT, there)
        best = found[np.argmax(scores)]
        np.testing.assert_allclose(best, [*pose[:2], se2.wrap(pose[2])], atol=0.1)
        assert scores.max() == pytest.approx(finely(LEFT, there, pose), rel=0.1)


def test_no_place_counts_much_in_another_building() -> None:
    _, scores = places(LEFT, part(OTHER_BUILDING, 0, 20))
    assert scores.max() < 6 < places(LEFT, RIGHT)[1].max()


def test_what_was_seen_through_counts_against_a_place() -> None:
    """A room with a partition, and the same room seen empty: five metres for each of three."""
    corners = rectangle(0, 0, 8, 6)
    free = (rectangle(0.15, 0.15, 7.85, 5.85),)
    empty = line_map(walls_of(corners), free)
    parted = line_map(np.vstack([walls_of(corners), [[4.0, 1.5, 4, 4.5]]]), free)
    whole, cut = (places(empty, lines)[1].max() for lines in (empty, parted))
    assert cut < whole - 5


def test_walls_that_face_the_other_way_are_no_place() -> None:
    wall = line_map(np.array([[0.0, 0, 10, 0], [10, 0, 10, 4]]))
    turned = line_map(wall.segments[:, [2, 3, 0, 1]])
    found, scores = places(wall, turned)
    good = found[scores > 6]
    assert (np.abs(se2.wrap(good[:, 2])) > 3).all()


def test_only_turns_at_which_enough_wall_is_parallel_are_tried() -> None:
    found, _ = places(LEFT, LEFT)
    turns = np.unique(np.round(se2.wrap(found[:, 2]) / (np.pi / 2)))
    apart = se2.wrap(found[:, 2]) - np.pi / 2 * np.round(se2.wrap(found[:, 2]) / (np.pi / 2))
    assert len(turns) > 1 and np.abs(apart).max() < 0.2


def test_a_map_of_one_wall_is_laid_along_it() -> None:
    wall = line_map(np.array([[0.0, 0, 10, 0]]))
    found, scores = places(wall, wall)
    assert scores.max() == pytest.approx(10, rel=0.1)
    assert abs(found[np.argmax(scores), 1]) < 0.1


def mirrored_most(reference: LineMap, other: LineMap) -> float:
    maps = [CoarseMap.of(lines, P, JUDGED) for lines in (reference, other)]
    return most_if_mirrored(maps[0], maps[1], P, JUDGED)


def test_what_fits_mirrored_counts_half_of_what_it_has_in_common_at_least(rng: Generator) -> None:
    """And what fits as it is, or nowhere, counts less."""
    for pose in [random_pose(rng) for _ in range(5)]:
        there = mirrored(RIGHT).moved(pose)
        assert mirrored_most(LEFT, there) > 0.5 * finely(LEFT, RIGHT, np.zeros(3))
        assert mirrored_most(LEFT, RIGHT.moved(pose)) < 0.5 * finely(LEFT, RIGHT, np.zeros(3))
    assert mirrored_most(LEFT, part(OTHER_BUILDING, 0, 20)) < 6


def test_mirrored_cells_and_samples_are_those_of_the_mirrored_map() -> None:
    """Shifts count the same, whichever of the two is mirrored."""
    for lines in (LEFT, RIGHT, part(OTHER_BUILDING, 0, 20)):
        turned = mirrored(lines)
        most = mirrored_most(lines, turned)
        assert mirrored_most(turned, lines) == pytest.approx(most, rel=0.15)
        assert most > 0.7 * finely(lines, lines, np.zeros(3))
