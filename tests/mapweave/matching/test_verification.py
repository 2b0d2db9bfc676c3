"""What two maps say of a transform: metres in common, and metres that one saw through."""

import numpy as np
import pytest
from numpy.random import Generator

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.maps import LineMap
from mapweave.matching.distance_field import DistanceField, DistanceFieldParameters
from mapweave.matching.verification import (
    Verdict,
    VerificationParameters,
    coarse_scores,
    shared_complexity,
    verify,
)
from tests.mapweave.buildings import BUILDING, line_map, part, random_pose, rectangle, walls_of

P = VerificationParameters()
RASTER = DistanceFieldParameters()
STILL = np.zeros(3)
LEFT, RIGHT = part(BUILDING, 0, 18), part(BUILDING, 8, 30)


def judged(reference: LineMap, other: LineMap, transform: FloatArray = STILL) -> Verdict:
    return verify(
        DistanceField.of(reference, RASTER), DistanceField.of(other, RASTER), transform, P
    )


def wall_of(lines: LineMap) -> float:
    return float(np.hypot(*(lines.segments[:, 2:] - lines.segments[:, :2]).T).sum())


def test_a_map_has_all_its_wall_in_common_with_itself() -> None:
    verdict = judged(LEFT, LEFT)
    assert verdict.common == pytest.approx(wall_of(LEFT), rel=0.01)
    assert (verdict.contradicted, verdict.overlap) == (0, 1)
    assert verdict.residual < RASTER.cell


def test_two_halves_have_in_common_what_lies_in_both() -> None:
    verdict = judged(LEFT, RIGHT)
    assert verdict.common == pytest.approx(wall_of(part(BUILDING, 8, 18)), rel=0.03)
    assert verdict.contradicted == pytest.approx(0, abs=0.5)


def test_wall_that_one_map_has_twice_is_in_common_once() -> None:
    """Doubled walls prove no more of a place than single ones do: the smaller length counts."""
    single = line_map(np.array([[0.0, 0, 6, 0]]))
    doubled = line_map(np.array([[0.0, 0, 6, 0], [0.0, 0.05, 6, 0.05]]))
    assert judged(single, doubled).common == pytest.approx(6, rel=0.02)
    assert judged(doubled, single).common == pytest.approx(6, rel=0.02)


def test_a_wall_in_what_the_other_saw_through_is_a_contradiction() -> None:
    """A room with a partition 3 m long against the same room, seen empty."""
    corners = rectangle(0, 0, 8, 6)
    free = (rectangle(0.15, 0.15, 7.85, 5.85),)
    empty = line_map(walls_of(corners), free)
    parted = line_map(np.vstack([walls_of(corners), [[4, 1.5, 4, 4.5]]]))
    assert judged(empty, empty).contradicted == 0
    assert judged(empty, parted).contradicted == pytest.approx(3, abs=0.3)
    assert judged(parted, empty).contradicted == pytest.approx(3, abs=0.3)


@pytest.mark.parametrize(("weight", "score"), [(1.0, 27.0), (5.0, 15.0)])
def test_the_score_is_the_wall_in_common_less_what_is_contradicted(
    weight: float, score: float
) -> None:
    """Metres for and metres against; what a metre against outweighs is a parameter."""
    assert Verdict(30.0, 3.0, 0.9, 0.02, 9.0, weight).score == pytest.approx(score)


def test_of_two_transforms_that_match_as_much_wall_the_contradicted_one_scores_less() -> None:
    """An empty room against one with a partition: seen through there, or not looked at."""
    corners = rectangle(0, 0, 8, 6)
    parted = line_map(np.vstack([walls_of(corners), [[4, 1.5, 4, 4.5]]]))
    blind = line_map(walls_of(corners))
    seeing = line_map(walls_of(corners), (rectangle(0.15, 0.15, 7.85, 5.85),))
    assert judged(seeing, parted).common == pytest.approx(judged(blind, parted).common)
    assert judged(seeing, parted).score == pytest.approx(judged(blind, parted).score - 3, abs=0.3)


def test_what_its_own_map_saw_through_later_refutes_nothing() -> None:
    """A door that was shut and then open stands in free space of both."""
    corners = rectangle(0, 0, 8, 6)
    free = (rectangle(0.15, 0.15, 7.85, 5.85),)
    opened = line_map(np.vstack([walls_of(corners), [[4, 1.5, 4, 4.5]]]), free)
    assert judged(line_map(walls_of(corners), free), opened).contradicted == 0


def test_walls_seen_from_different_sides_do_not_coincide() -> None:
    lines = part(BUILDING, 0, 30)
    turned = LineMap(lines.segments[:, [2, 3, 0, 1]], lines.polyline, lines.support)
    assert judged(lines, turned).common < 0.05 * wall_of(lines)


def test_parallel_walls_hold_only_across() -> None:
    """Held is the wall that holds the weakest direction: nil here, half of a square room's."""
    walls = line_map(np.array([[0.0, 0, 9, 0], [9, 2, 0, 2]]))
    assert judged(walls, walls).held == pytest.approx(0, abs=1e-9)
    square = line_map(walls_of(rectangle(0, 0, 5, 5)))
    assert judged(square, square).held == pytest.approx(10)


def test_the_verdict_depends_on_no_frame(rng: Generator) -> None:
    here = judged(LEFT, RIGHT)
    a, b = random_pose(rng), random_pose(rng)
    there = judged(LEFT.moved(a), RIGHT.moved(b), se2.between(se2.inverse(a), se2.inverse(b)))
    assert there.common == pytest.approx(here.common, rel=0.03)
    assert there.contradicted == pytest.approx(here.contradicted, abs=0.5)
    assert there.held == pytest.approx(here.held, rel=0.06)


def test_the_verdict_is_the_same_from_both_sides() -> None:
    transform = np.array([0.1, -0.05, 0.01])
    one, other = judged(LEFT, RIGHT, transform), judged(RIGHT, LEFT, se2.inverse(transform))
    assert other.common == pytest.approx(one.common)
    assert other.contradicted == pytest.approx(one.contradicted)


@pytest.mark.parametrize("seed", range(5))
def test_the_true_transform_scores_far_better_than_any_wrong_one(seed: int) -> None:
    rng = np.random.default_rng(seed)
    wrong = np.array([random_pose(rng, 15) for _ in range(200)])
    middle = np.array([13.0, 1.0])
    moved = np.array([np.hypot(*(se2.transform_points(t, middle) - middle)) for t in wrong])
    wrong = wrong[(moved > 1) | (np.abs(wrong[:, 2]) > 0.16)]
    scores = coarse_scores(
        DistanceField.of(LEFT, RASTER),
        DistanceField.of(RIGHT, RASTER),
        np.vstack([STILL, wrong]),
        250,
        P,
    )
    assert scores[0] > 2 * scores[1:].max()


def test_coarse_scores_are_near_the_full_ones() -> None:
    a, b = DistanceField.of(LEFT, RASTER), DistanceField.of(RIGHT, RASTER)
    for transform in (STILL, np.array([0.15, 0, 0.0]), np.array([3.0, 1.0, 0.2])):
        full = verify(a, b, transform, P)
        coarse = float(coarse_scores(a, b, transform[None], 250, P)[0])
        # The full verdict takes the smaller common part and adds both contradictions.
        assert abs(coarse - full.score) < 0.15 * wall_of(LEFT) + full.contradicted


def coarse(reference: LineMap, other: LineMap) -> float:
    """Return the coarse score of two maps in one frame [m]."""
    rasters = [DistanceField.of(lines, RASTER) for lines in (reference, other)]
    return float(coarse_scores(rasters[0], rasters[1], STILL[None], 250, P)[0])


def test_coarse_scores_count_what_the_other_saw_through_against_a_transform() -> None:
    """3 m of partition, contradicted one way of two: 1.5 m less than where nobody looked."""
    corners = rectangle(0, 0, 8, 6)
    parted = line_map(np.vstack([walls_of(corners), [[4, 1.5, 4, 4.5]]]))
    blind = line_map(walls_of(corners))
    seeing = line_map(walls_of(corners), (rectangle(0.15, 0.15, 7.85, 5.85),))
    assert coarse(seeing, parted) == pytest.approx(coarse(blind, parted) - 1.5, abs=0.3)


def test_in_coarse_scores_walls_seen_from_different_sides_do_not_coincide() -> None:
    walls = line_map(walls_of(BUILDING))
    turned = line_map(walls.segments[:, [2, 3, 0, 1]])
    assert coarse(walls, walls) > 0.9 * wall_of(walls)
    assert abs(coarse(walls, turned)) < 0.05 * wall_of(walls)


def test_shared_complexity_is_that_of_the_shape_in_common() -> None:
    """Straight walls in common have none; a niche in common has (paper, V2)."""
    straight = line_map(np.array([[0.0, 0, 9, 0], [9, 2, 0, 2]]))
    assert _shared(straight, straight) == pytest.approx(0, abs=1e-9)
    assert _shared(LEFT, RIGHT) > 1


def test_a_shape_that_only_one_of_two_maps_has_is_not_shared() -> None:
    """Both have the corridor's walls; the niche at its end is in one of them alone."""
    corridor = line_map(np.array([[0.0, 0, 9, 0], [9, 2, 0, 2]]))
    niche = [[20.0, 0, 21, 0], [21.0, 0, 21, -1], [21.0, -1, 22, -1], [22.0, -1, 22, 0]]
    with_niche = line_map(np.vstack([corridor.segments, niche]))
    assert _shared(with_niche, with_niche) > 0.5
    assert _shared(corridor, with_niche) == pytest.approx(0, abs=1e-9)


def test_of_a_polyline_the_part_that_coincides_is_shared() -> None:
    """An L of which the other map has one leg only is a straight wall to both."""
    corner = line_map(np.array([[0.0, 0, 6, 0], [6.0, 0, 6, 4]]))
    leg = line_map(np.array([[0.0, 0, 6, 0]]))
    assert _shared(corner, corner) > 0.5
    assert _shared(leg, corner) == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize(("known", "shared"), [(1.0, False), (3.0, True)])
def test_a_segment_is_shared_where_half_of_it_coincides(known: float, shared: bool) -> None:
    """An L whose second leg of 4 m the other map has in part."""
    corner = line_map(np.array([[0.0, 0, 6, 0], [6.0, 0, 6, 4]]))
    partly = line_map(np.array([[0.0, 0, 6, 0], [6.0, 0, 6, known]]))
    assert (_shared(partly, corner) > 0.5) == shared


def _shared(reference: LineMap, other: LineMap) -> float:
    a, b = DistanceField.of(reference, RASTER), DistanceField.of(other, RASTER)
    return shared_complexity(a, b, STILL, other, P)
