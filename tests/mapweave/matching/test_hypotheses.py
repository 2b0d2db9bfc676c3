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
    shaken,
)

P = HypothesisParameters()


def proposed(reference: LineMap, other: LineMap) -> tuple[FloatArray, FloatArray]:
    shapes = [PreparedMap.of(lines, P, DistanceFieldParameters()) for lines in (reference, other)]
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


def test_the_best_of_what_is_alike_is_kept_and_the_rest_dropped(rng: Generator) -> None:
    """Brute force: in the order of scores, kept is what differs from all that was kept before."""
    transforms = np.column_stack([rng.uniform(-3, 3, (80, 2)), rng.uniform(-0.5, 0.5, 80)])
    scores, middle = rng.uniform(0, 9, 80), np.array([7.0, -2.0])
    kept: list[int] = []
    for k in np.argsort(-scores):
        here = se2.transform_points(transforms[k], middle)
        if all(
            np.hypot(*(se2.transform_points(transforms[j], middle) - here)) > P.distance
            or abs(float(se2.wrap(transforms[j, 2] - transforms[k, 2]))) > P.turn
            for j in kept
        ):
            kept.append(int(k))
    assert different(transforms, scores, middle, P) == kept[: P.count]
