"""The loop as the paper prints it: H1, H2, V1, V2 (paper, VIII), in closed forms."""

from math import pi, sqrt

import numpy as np
import pytest

from mapweave.errors import ArgumentError
from mapweave.fusion.reference import (
    ReferenceParameters,
    close_parts,
    congruent_alignment,
    first_confirmed,
    hausdorff,
    most_similar,
    proposals,
    salient_parts,
    shared_complexity,
)
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.maps import LineMap
from tests.mapweave.buildings import BUILDING, line_map, part, random_pose, shaken

SEEDS = range(6)
RIGHT_ANGLE = np.array([[0.0, 0, 2, 0], [2, 0, 2, 2]])  # sc = (π/4)² = 0.617
FLAT_ANGLE = np.array([[10.0, 0, 12, 0], [12, 0, 12 + sqrt(2), sqrt(2)]])  # 45°: (π/8)² = 0.154
WALL = np.array([[20.0, 0, 26, 0]])


def random_segments(seed: int, n: int) -> FloatArray:
    return np.random.default_rng(seed).uniform(-3, 3, (n, 4))


def scaled(lines: LineMap, scale: float) -> LineMap:
    return LineMap(scale * lines.segments, lines.polyline, lines.support)


def error(transform: FloatArray, true: FloatArray) -> tuple[float, float]:
    """Return how far apart two transforms put the origin [m], and how differently turned [rad]."""
    x, y, turn = se2.between(true, transform)
    return float(np.hypot(x, y)), abs(float(turn))


def test_the_most_complex_object_comes_first_and_a_straight_wall_is_none() -> None:
    lines = line_map(np.vstack([WALL, FLAT_ANGLE, RIGHT_ANGLE]))
    found = salient_parts(lines, ReferenceParameters(min_complexity=0.1))
    np.testing.assert_array_equal(found, [RIGHT_ANGLE, FLAT_ANGLE])


def test_what_is_not_above_the_threshold_is_not_selected() -> None:
    lines = line_map(np.vstack([FLAT_ANGLE, RIGHT_ANGLE]))
    found = salient_parts(lines, ReferenceParameters(min_complexity=0.2))  # of 0.154 and 0.617
    np.testing.assert_array_equal(found, [RIGHT_ANGLE])


def test_objects_of_some_segments_slide_along_the_polyline() -> None:
    stairs = np.array([[0.0, 0, 1, 0], [1, 0, 1, 1], [1, 1, 1.5, 1]])
    found = salient_parts(line_map(stairs), ReferenceParameters(part_segments=2))
    np.testing.assert_array_equal(found, [stairs[:2], stairs[1:]])  # (π/4)²; 2/9 (π/2)²


def test_the_most_similar_stretch_of_all_polylines_is_taken() -> None:
    lines = line_map(np.vstack([WALL, FLAT_ANGLE, RIGHT_ANGLE + 5]))
    found = most_similar(RIGHT_ANGLE / 2, lines)
    assert found is not None
    assert found.similarity == pytest.approx(0, abs=1e-12)
    np.testing.assert_allclose(found.stretch, [[6, 5, 7, 5], [7, 5, 7, 6]])


def test_no_polyline_is_similar_where_all_are_shorter() -> None:
    assert most_similar(RIGHT_ANGLE, line_map(FLAT_ANGLE / 2)) is None


@pytest.mark.parametrize("seed", SEEDS)
def test_a_moved_copy_is_aligned_exactly(seed: int) -> None:
    pose = random_pose(np.random.default_rng(seed))
    moved = se2.transform_segments(se2.inverse(pose), RIGHT_ANGLE)
    assert error(congruent_alignment(RIGHT_ANGLE, moved), pose) == pytest.approx((0, 0), abs=1e-9)


def test_a_straight_line_is_laid_through_the_middle_of_a_corner_at_half_its_turn() -> None:
    """By hand: Θ = 45°; the corner's centroid is (1.5, 0.5), the line's turns to (√2, √2)."""
    found = congruent_alignment(RIGHT_ANGLE, np.array([[0.0, 0, 4, 0]]))
    np.testing.assert_allclose(found, [1.5 - sqrt(2), 0.5 - sqrt(2), pi / 4])


def test_hausdorff_distance_of_segments_by_hand() -> None:
    wall = np.array([[0.0, 0, 4, 0]])
    others = np.array(
        [
            [0.0, 3, 4, 3],  # parallel, 3 m away
            [4, 0, 0, 0],  # itself, the other way round
            [1, 1, 2, 1],  # shorter: the wall's far end is √(2² + 1²) from it
            [2, -1, 2, 5],  # across: its own end is 5 m away
        ]
    )
    np.testing.assert_allclose(hausdorff(wall, others), [[3, 0, sqrt(5), 5]])


@pytest.mark.parametrize("seed", SEEDS)
def test_end_points_give_the_hausdorff_distance_of_all_points(seed: int) -> None:
    """Brute force: 400 points on each segment, every one to every one."""
    first, second = random_segments(seed, 3), random_segments(seed + 50, 4)
    share = np.linspace(0, 1, 400)[:, None]
    dense = [[s[:2] + share * (s[2:] - s[:2]) for s in segments] for segments in (first, second)]
    for i, a in enumerate(dense[0]):
        for j, b in enumerate(dense[1]):
            apart = np.linalg.norm(a[:, None] - b, axis=-1)
            brute = max(apart.min(axis=1).max(), apart.min(axis=0).max())
            assert hausdorff(first, second)[i, j] == pytest.approx(brute, abs=0.03)


@pytest.mark.parametrize("seed", SEEDS)
def test_close_parts_are_symmetric_and_move_with_the_maps(seed: int) -> None:
    first = random_segments(seed, 12)
    second = np.vstack([first[:5] + 0.05, random_segments(seed + 50, 6)])
    pose = random_pose(np.random.default_rng(seed))
    here, there = close_parts(first, second, 0.25)
    np.testing.assert_array_equal(np.concatenate(close_parts(second, first, 0.25)), [*there, *here])
    moved = [se2.transform_segments(pose, s) for s in (first, second)]
    still = np.concatenate(close_parts(moved[0], moved[1], 0.25))
    np.testing.assert_array_equal(still, [*here, *there])
    assert here[:5].all()
    assert there[:5].all()


def test_what_is_shared_is_as_complex_as_its_polylines_are_within_it() -> None:
    """By hand: of a right angle one leg is far from the other map: the other leg is straight."""
    lines = line_map(RIGHT_ANGLE)
    assert shared_complexity(lines, lines, 0.25) == pytest.approx((pi / 4) ** 2)
    assert shared_complexity(lines, line_map(RIGHT_ANGLE[:1]), 0.25) == pytest.approx(0)
    assert shared_complexity(lines, line_map(WALL), 0.25) == 0


@pytest.mark.parametrize("seed", SEEDS)
def test_the_loop_aligns_two_views_of_a_building(seed: int) -> None:
    """What each saw of a corridor with niches, the other one shaken and somewhere else."""
    rng = np.random.default_rng(seed)
    pose = random_pose(rng)
    first, second = part(BUILDING, -1, 20), shaken(part(BUILDING, -1, 31), rng, 0.005)
    found = first_confirmed(first, second.moved(se2.inverse(pose)))
    assert found is not None
    distance, turn = error(found.transform, pose)
    assert (distance < 0.5, turn < np.radians(3)) == (True, True)


@pytest.mark.parametrize("seed", SEEDS)
def test_proposals_move_with_either_map(seed: int) -> None:
    rng = np.random.default_rng(seed)
    a, b = random_pose(rng), random_pose(rng)
    first, second = part(BUILDING, 0, 16), shaken(part(BUILDING, 5, 31), rng)
    p = ReferenceParameters(part_segments=5)
    still = list(proposals(first, second, p))
    moved = list(proposals(first.moved(a), second.moved(b), p))
    assert still
    assert [x.confirmed for x in moved] == [x.confirmed for x in still]
    for x, y in zip(still, moved, strict=True):
        expected = se2.compose(se2.compose(a, x.transform), se2.inverse(b))
        assert error(y.transform, expected) == pytest.approx((0, 0), abs=1e-6)


def test_proposals_scale_with_both_maps() -> None:
    first, second = part(BUILDING, 0, 16), part(BUILDING, 5, 31)
    still = list(proposals(first, second, ReferenceParameters(part_segments=5)))
    larger = list(
        proposals(
            scaled(first, 3),
            scaled(second, 3),
            ReferenceParameters(part_segments=5, hausdorff=0.75),
        )
    )
    assert still
    assert [x.confirmed for x in larger] == [x.confirmed for x in still]
    for x, y in zip(still, larger, strict=True):
        assert error(y.transform, x.transform * [3, 3, 1]) == pytest.approx((0, 0), abs=1e-9)


def test_rounds_come_in_the_order_of_complexity() -> None:
    found = list(proposals(part(BUILDING, 0, 16), part(BUILDING, 5, 31)))
    complexity = [x.complexity for x in found]
    assert complexity == sorted(complexity, reverse=True)


def test_straight_walls_alone_cannot_be_fused() -> None:
    """H1 ends the loop: no object is complex enough."""
    assert first_confirmed(line_map(WALL), line_map(WALL)) is None


def test_an_alignment_that_lays_nothing_close_is_rejected() -> None:
    """A corner laid on a straight wall at 45° (V1): both legs stick out by more than a metre."""
    (only,) = proposals(line_map(RIGHT_ANGLE), line_map(WALL))
    assert (only.confirmed, only.shared_complexity) == (False, 0)
    assert first_confirmed(line_map(RIGHT_ANGLE), line_map(WALL)) is None


def test_the_corner_that_proposed_an_alignment_confirms_it_whatever_else_is_there() -> None:
    """Why the loop is a reference only: to V2 as printed one corner is enough.

    Two different places that have a corner in common; `mapweave.fusion.align` counts what the
    other map saw through.
    """
    other = line_map(np.vstack([RIGHT_ANGLE, WALL, WALL + 1]))
    found = first_confirmed(line_map(np.vstack([RIGHT_ANGLE, -3 * WALL])), other)
    assert found is not None
    np.testing.assert_allclose(found.transform, [0, 0, 0], atol=1e-9)


@pytest.mark.parametrize(("first", "second"), [(0, 1), (1, 0), (0, 0)])
def test_a_map_of_nothing_gives_no_proposals(first: int, second: int) -> None:
    maps = [LineMap.empty(), line_map(RIGHT_ANGLE)]
    assert list(proposals(maps[first], maps[second])) == []


def test_the_pieces_take_lists_and_vertices_and_refuse_by_name_what_is_neither() -> None:
    corner = [[0, 0], [2, 0], [2, 2]]
    np.testing.assert_array_equal(hausdorff(corner, corner), hausdorff(RIGHT_ANGLE, RIGHT_ANGLE))
    np.testing.assert_allclose(congruent_alignment(corner, RIGHT_ANGLE), 0, atol=1e-12)
    with pytest.raises(ArgumentError, match=r"^second: expected finite"):
        close_parts(corner, [[0, 0, 1, np.nan]], 0.3)
    with pytest.raises(ArgumentError, match=r"^part: expected \(n, 4\) segments"):
        congruent_alignment([[0, 0, 0]], corner)
