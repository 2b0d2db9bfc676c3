"""Hypotheses: the true transform is among those that two maps propose (paper, H1 and H2)."""

import numpy as np
import pytest
from numpy.random import Generator

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.maps import LineMap
from mapweave.matching.distance_field import DistanceFieldParameters
from mapweave.matching.hypotheses import HypothesisParameters, PreparedMap, different, hypothesise
from mapweave.matching.verification import VerificationParameters
from tests.mapweave.buildings import (
    BUILDING,
    OTHER_BUILDING,
    line_map,
    part,
    random_pose,
    rectangle,
    shaken,
    walls_of,
)

P = HypothesisParameters()


def proposed(reference: LineMap, other: LineMap) -> tuple[FloatArray, FloatArray]:
    shapes = [
        PreparedMap(lines, P, DistanceFieldParameters(), VerificationParameters())
        for lines in (reference, other)
    ]
    return hypothesise(shapes[0], shapes[1], P, VerificationParameters())


def middle_of(lines: LineMap) -> FloatArray:
    return np.asarray(lines.segments.reshape(-1, 2).mean(axis=0))


@pytest.mark.parametrize(
    ("outline", "left", "right"),
    [
        (BUILDING, (0, 18), (8, 30)),
        (BUILDING, (0, 14), (9, 30)),
        (OTHER_BUILDING, (0, 17), (8, 26)),
    ],
)
@pytest.mark.parametrize("seed", range(4))
def test_the_true_pose_of_two_halves_of_a_building_is_among_the_hypotheses(
    outline: FloatArray, left: tuple[float, float], right: tuple[float, float], seed: int
) -> None:
    rng = np.random.default_rng(seed)
    true = random_pose(rng)
    other = shaken(part(outline, *right), rng).moved(se2.inverse(true))
    transforms, _ = proposed(shaken(part(outline, *left), rng), other)
    off = np.array([se2.transform_points(t, middle_of(other)) for t in transforms])
    apart = np.hypot(*(off - se2.transform_points(true, middle_of(other))).T)
    turned = np.abs(se2.wrap(transforms[:, 2] - true[2]))
    assert ((apart < 0.5) & (turned < 0.09)).any()


def bends() -> LineMap:
    """Return a wall of gentle bends: no two of its straight parts make a corner."""
    direction = np.cumsum(np.deg2rad([0, 30, 30, -30, -30, -30, -30, 30, 30, 30]))
    length = np.array([4.0, 5, 4, 6, 4, 4, 5, 4, 7, 4])
    steps = length[:, None] * np.column_stack([np.cos(direction), np.sin(direction)])
    ends = np.cumsum(steps, axis=0)
    return line_map(np.hstack([ends - steps, ends]))


def broken(lines: LineMap) -> LineMap:
    """Return `lines`, no two of them on one polyline."""
    alone = np.arange(len(lines.segments))
    return LineMap(lines.segments, alone, lines.support, lines.free_space)


def with_cabins(lines: LineMap, count: int, turn: float) -> LineMap:
    """Return `lines` and, far off, so many square cabins turned by `turn` [degrees]."""
    cabin = line_map(walls_of(rectangle(0, 0, 3, 3)))
    places = [np.array([100 + 9.0 * k, 40 + k % 2, np.deg2rad(turn)]) for k in range(count)]
    return LineMap.union([lines, *(broken(cabin.moved(place)) for place in places)])


@pytest.mark.parametrize(
    ("lines", "cabins", "turn"),
    [
        (part(BUILDING, 8, 18), 20, 35.0),
        (broken(part(BUILDING, 8, 18)), 20, 35.0),
        (bends(), 40, 15.0),
    ],
    ids=["polylines with corners", "corners alone", "polylines alone"],
)
def test_where_most_walls_run_other_ways_shapes_propose_the_true_pose(
    lines: LineMap, cabins: int, turn: float
) -> None:
    """Walls parallel to those of the cabins, most of the other map's, lead to wrong turns only."""
    true = np.array([3.0, -2.0, 1.0])
    transforms, _ = proposed(lines, with_cabins(lines, cabins, turn).moved(se2.inverse(true)))
    middle = middle_of(lines)
    there = se2.transform_points(se2.inverse(true), middle)
    apart = [np.hypot(*(se2.transform_points(t, there) - middle)) for t in transforms]
    turned = np.abs(se2.wrap(transforms[:, 2] - true[2]))
    assert ((np.array(apart) < 0.5) & (turned < 0.09)).any()


def test_hypotheses_lie_wall_on_wall() -> None:
    """Whoever proposes is off by what alignment mends: 0.3 m here, and 2°."""
    shapes = [
        PreparedMap(lines, P, DistanceFieldParameters(), VerificationParameters())
        for lines in (part(BUILDING, 0, 18), part(BUILDING, 8, 30))
    ]
    about = np.array([13.0, 1.0, 0.0])  # where both looked
    off = se2.compose(se2.compose(about, [0.2, -0.2, 0.035]), se2.inverse(about))
    found, _ = hypothesise(shapes[0], shapes[1], P, VerificationParameters(), off[None])
    assert np.hypot(*(se2.transform_points(found[0], about[:2]) - about[:2])) < 0.05
    assert abs(found[0, 2]) < np.radians(0.5)


def test_hypotheses_come_best_first_and_all_differ() -> None:
    other = part(BUILDING, 8, 30)
    transforms, scores = proposed(part(BUILDING, 0, 18), other)
    assert 2 <= len(transforms) <= P.count
    assert (np.diff(scores) <= 0).all()
    places = np.array([se2.transform_points(t, middle_of(other)) for t in transforms])
    for k in range(len(transforms)):
        apart = np.hypot(*(places[:k] - places[k]).T)
        turned = np.abs(se2.wrap(transforms[:k, 2] - transforms[k, 2]))
        # Measured at the middle of the wall; here at the middle of the ends, hence the slack.
        assert ((apart > 0.7 * P.distance) | (turned > P.turn)).all()


def test_straight_walls_propose_only_to_slide_along_them() -> None:
    """Corridors without a corner in sight: wall lies on wall, turned by half a turn or not."""
    walls = line_map(np.array([[0.0, 0, 30, 0], [30, 2, 0, 2]]))
    transforms, _ = proposed(walls, walls)
    middle = np.array([se2.transform_points(t, [15.0, 1.0]) for t in transforms])
    np.testing.assert_allclose(middle[:, 1], 1, atol=0.2)
    np.testing.assert_allclose(np.sin(transforms[:, 2]), 0, atol=0.02)


@pytest.mark.parametrize("middle", [(7.0, -2.0), (60.0, -25.0)])
def test_the_best_of_what_is_alike_is_kept_and_the_rest_dropped(
    middle: tuple[float, float], rng: Generator
) -> None:
    """Brute force: in the order of scores, kept is what differs from all that was kept before."""
    transforms = np.column_stack([rng.uniform(-1, 1, (80, 2)), rng.uniform(-0.3, 0.3, 80)])
    scores = rng.uniform(0, 9, 80)
    kept: list[int] = []
    for k in np.argsort(-scores):
        here = se2.transform_points(transforms[k], middle)
        if all(
            np.hypot(*(se2.transform_points(transforms[j], middle) - here)) > P.distance
            or abs(float(se2.wrap(transforms[j, 2] - transforms[k, 2]))) > P.turn
            for j in kept
        ):
            kept.append(int(k))
    assert different(transforms, scores, np.array(middle), P) == kept[: P.count]
