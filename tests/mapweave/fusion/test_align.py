"""Fusion joins maps where walls and free space prove it, and says why where not (paper, VIII)."""

import re

import numpy as np
import pytest
from numpy.random import Generator

from mapweave.fusion.align import FusionParameters, align, align_maps
from mapweave.fusion.decision import DecisionParameters, Hypothesis, decide
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.maps import Alignment, LineMap, RobotMap, Submap, Trajectory
from mapweave.matching.field_icp import FieldIcpParameters
from mapweave.matching.hypotheses import HypothesisParameters
from mapweave.matching.verification import Verdict
from mapweave.reasons import ReasonKind
from tests.mapweave.buildings import (
    BUILDING,
    OTHER_BUILDING,
    corridor,
    line_map,
    part,
    random_pose,
    rectangle,
    shaken,
    walls_of,
)

MIDDLE = np.array([13.0, 1.0])
LEFT, RIGHT = part(BUILDING, 0, 18), part(BUILDING, 8, 30)
# The same straight corridor, 24 m of it, between different ends.
LOOK_ALIKE = corridor(34, [(1, 4, 3.0), (30, 33, 1.5)], [(2, 3, 1.0)])
LOOK_ALIKE_TOO = corridor(34, [(2, 3.2, 0.8)], [(0.5, 2, 2.0), (29, 32.5, 2.6)])
SYMMETRIC = corridor(20, [(2, 5, 3.0), (8, 9, 1.0)], [(11, 12, 1.0), (15, 18, 3.0)])


def compared(
    reference: LineMap, other: LineMap, seed: int, parameters: FusionParameters | None = None
) -> tuple[Alignment, FloatArray]:
    """Align two noisy maps, given in unknown frames.

    Returns the alignment, and its transform taken back into the building's frame: the identity,
    if it is right.
    """
    rng = np.random.default_rng(seed)
    a, b = random_pose(rng), random_pose(rng)
    found = align_maps(
        ("a/0", shaken(reference, rng).moved(a)), ("b/0", shaken(other, rng).moved(b)), parameters
    )
    return found, se2.compose(se2.inverse(a), se2.compose(found.transform, b))


def assert_right(found: FloatArray, true: FloatArray = se2.IDENTITY) -> None:
    """Check that the building's middle lands within 0.1 m and 1°."""
    off = se2.transform_points(found, MIDDLE) - se2.transform_points(true, MIDDLE)
    assert np.hypot(*off) < 0.1
    assert abs(np.degrees(se2.wrap(found[2] - true[2]))) < 1


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize(("low", "high"), [(8, 18), (9, 14)])
def test_two_maps_with_a_part_in_common_are_joined_rightly(
    low: float, high: float, seed: int
) -> None:
    found, residual = compared(part(BUILDING, 0, high), part(BUILDING, low, 30), seed)
    assert found.decision == "accepted"
    assert found.confidence > 0.6
    assert_right(residual)


@pytest.mark.parametrize("seed", range(3))
def test_maps_without_a_part_in_common_are_refused(seed: int) -> None:
    found, _ = compared(part(BUILDING, 0, 12), part(BUILDING, 16, 30), seed)
    assert found.decision == "refused"
    assert found.confidence < 0.5


@pytest.mark.parametrize("seed", range(3))
def test_different_buildings_are_refused(seed: int) -> None:
    found, _ = compared(part(BUILDING, 0, 30), part(OTHER_BUILDING, 0, 26), seed)
    assert found.decision == "refused"


@pytest.mark.parametrize("seed", range(3))
def test_corridors_that_look_alike_are_not_joined(seed: int) -> None:
    found, _ = compared(part(LOOK_ALIKE, 0, 34), part(LOOK_ALIKE_TOO, 0, 34), seed)
    assert found.decision != "accepted"


@pytest.mark.parametrize("seed", range(3))
def test_a_straight_corridor_in_common_may_slide_and_is_ambiguous(seed: int) -> None:
    """Each robot saw one end and the middle; the walls in common are parallel."""
    found, _ = compared(part(LOOK_ALIKE, 0, 26), part(LOOK_ALIKE, 8, 34), seed)
    assert found.decision == "ambiguous"
    assert found.cause.kind is ReasonKind.PARALLEL


@pytest.mark.parametrize("seed", range(3))
def test_a_building_that_half_a_turn_maps_onto_itself_is_ambiguous(seed: int) -> None:
    found, _ = compared(part(SYMMETRIC, 0, 20), part(SYMMETRIC, 0, 20), seed)
    assert found.decision == "ambiguous"
    assert re.search(r"turned by (179|180|181)°", found.reason)
    assert found.runner_up is not None
    assert found.runner_up.turn == pytest.approx(np.pi, abs=0.02)
    assert 0.4 < found.confidence < 0.65  # one is as probable as the other
    # Both put the other map into the same place: nearly no metres apart, whatever the frames.
    assert found.runner_up.distance is not None and found.runner_up.distance < 3


def twins(free: bool) -> tuple[LineMap, LineMap]:
    """Return two rooms with the same walls; one goes on where the other has a hall."""
    room = np.array([[0.0, 0, 6, 0], [6, 0, 6, 3], [6, 3, 7.5, 3], [0, 6, 0, 4], [0, 4, -1, 4]])
    cabinets = np.array([[1.0, 2, 4, 2.5], [4, 3, 4, 5], [2, 5, 2, 3.5]])
    hall = (rectangle(0.2, 0.2, 5.8, 5.8),)
    behind = np.array([[0.0, 3.9, 0, 0.1]])
    return (
        line_map(np.vstack([room, behind]), hall if free else ()),
        line_map(np.vstack([room, behind, cabinets])),
    )


@pytest.mark.parametrize("seed", range(3))
def test_free_space_makes_the_difference(seed: int) -> None:
    """The same walls: a match by walls alone, refused once one robot saw through the other's."""
    by_walls, _ = compared(*twins(free=False), seed)
    by_all, _ = compared(*twins(free=True), seed)
    assert by_walls.decision != "refused"
    assert by_walls.confidence > 0.7
    assert by_all.decision == "refused"
    assert by_all.confidence < 0.2


@pytest.mark.parametrize(
    ("reference", "other"),
    [
        (LEFT, RIGHT),
        (part(BUILDING, 0, 12), part(BUILDING, 16, 30)),
        (part(BUILDING, 0, 30), part(OTHER_BUILDING, 0, 26)),
        (part(SYMMETRIC, 0, 20), part(SYMMETRIC, 0, 20)),
        (LEFT, line_map(np.array([[0.0, 0, 1, 0], [1, 0, 1, 1]]))),
    ],
    ids=["joined", "apart", "different", "symmetric", "poor"],
)
def test_every_reason_is_one_line_that_names_metres(reference: LineMap, other: LineMap) -> None:
    reason = compared(reference, other, 1)[0].reason
    assert re.search(r"\d+(\.\d)? m of wall", reason)
    assert "\n" not in reason


def test_a_map_with_too_little_wall_is_refused_by_name() -> None:
    stub = line_map(np.array([[0.0, 0, 1, 0], [1, 0, 1, 1]]))
    for found in (
        align_maps(("a/0", LEFT), ("b/7", stub)),
        align_maps(("b/7", stub), ("a/0", LEFT)),
    ):
        assert (found.decision, found.confidence) == ("refused", 0.0)
        assert found.reason.startswith("b/7 has less than 4 m of wall")


def test_a_map_of_nothing_is_refused() -> None:
    found = align_maps(("a/0", LEFT), ("b/0", LineMap.empty()))
    assert found.decision == "refused"


def test_straight_walls_may_slide_and_are_ambiguous() -> None:
    walls = line_map(np.array([[0.0, 0, 30, 0], [30, 2, 0, 2]]))
    found = align_maps(("a/0", walls), ("b/0", walls))
    assert found.decision == "ambiguous"
    assert found.cause.kind is ReasonKind.PARALLEL


@pytest.mark.parametrize("seed", range(3))
def test_moving_a_map_composes_with_the_transform(seed: int) -> None:
    """Fusion knows nothing of frames: its transform, taken back, is the same in all of them."""
    rng = np.random.default_rng(seed)
    a, b = random_pose(rng), random_pose(rng)
    here = align_maps(("a/0", LEFT), ("b/0", RIGHT)).transform
    there = align_maps(("a/0", LEFT.moved(a)), ("b/0", RIGHT.moved(b))).transform
    assert_right(se2.compose(se2.inverse(a), se2.compose(there, b)), here)


def test_exchanging_the_maps_inverts_the_transform() -> None:
    one = align_maps(("a/0", LEFT), ("b/0", RIGHT))
    other = align_maps(("b/0", RIGHT), ("a/0", LEFT))
    assert one.decision == other.decision == "accepted"
    assert_right(se2.compose(one.transform, other.transform))


def test_evidence_and_runner_up_are_plain_finite_numbers() -> None:
    found, _ = compared(LEFT, RIGHT, 1)
    names = "common contradicted overlap residual held complexity rarity score reach place"
    numbers = found.evidence.by_name()
    assert names.split() == list(numbers)
    assert all(isinstance(number, float) for number in numbers.values())
    assert np.isfinite(list(numbers.values())).all()
    assert numbers["score"] == pytest.approx(
        numbers["common"]
        - FusionParameters().verification.contradiction_weight * numbers["contradicted"]
    )
    assert found.runner_up is not None
    assert found.runner_up.by_name()["score"] < 0.6 * numbers["score"]


def test_hypotheses_that_slide_into_one_are_not_each_others_rivals() -> None:
    """Ones that lie near each other, hardly aligned at first, end in the same place."""
    hardly = FieldIcpParameters(iterations=1, start_scale=0.001, end_scale=0.001)
    near = HypothesisParameters(distance=0.1, turn=0.01, alignment=hardly)
    parameters = FusionParameters(hypotheses=near)
    found, _ = compared(LEFT, RIGHT, 1, parameters)
    assert found.decision == "accepted"
    assert found.runner_up is not None
    distance, turn = found.runner_up.distance, found.runner_up.turn
    assert distance is not None and turn is not None
    assert distance > near.distance or turn > near.turn


def test_the_same_maps_give_the_same_alignment(rng: Generator) -> None:
    maps = ("a/0", shaken(LEFT, rng)), ("b/0", shaken(RIGHT, rng))
    one, other = align_maps(*maps), align_maps(*maps)
    np.testing.assert_array_equal(one.transform, other.transform)
    assert (one.reason, one.confidence, one.evidence) == (
        other.reason,
        other.confidence,
        other.evidence,
    )


def robot_map(robot: str, *components: LineMap) -> RobotMap:
    submaps = tuple(
        Submap(k, 2 * k, np.zeros(3), lines, Trajectory.empty())
        for k, lines in enumerate(components)
    )
    return RobotMap(robot, "boot", 1, submaps)


def test_every_component_of_one_robot_is_compared_with_every_one_of_the_other() -> None:
    stub = line_map(walls_of(rectangle(0, 0, 0.5, 0.5)))
    found = align(robot_map("a", LEFT, stub), robot_map("b", stub, RIGHT))
    assert {(one.reference, one.other): one.decision for one in found} == {
        ("a/0", "b/0"): "refused",
        ("a/0", "b/2"): "accepted",
        ("a/2", "b/0"): "refused",
        ("a/2", "b/2"): "refused",
    }


def test_robots_without_a_map_have_nothing_to_compare() -> None:
    assert align(robot_map("a"), robot_map("b", LEFT)) == []


@pytest.mark.parametrize(
    ("best", "rival", "decision"),
    [
        (12.0, 3.0, "accepted"),  # 9 m ahead
        (12.0, 5.7, "ambiguous"),  # less than half of it, but only 6.3 m ahead
        (40.0, 15.0, "accepted"),
        (40.0, 25.0, "ambiguous"),  # 15 m ahead, but more than half of it
        (12.0, -4.0, "accepted"),
    ],
)
def test_the_best_leads_by_metres_and_by_its_share(
    best: float, rival: float, decision: str
) -> None:
    """Of little wall in common, chance explains as much at two places."""

    def hypothesis(score: float, x: float) -> Hypothesis:
        verdict = Verdict(score, 0.0, 1.0, 0.02, 9.0, 5.0)
        return Hypothesis(np.array([x, 0.0, 0.0]), np.array([x, 0.0]), verdict, 0.5)

    found, reason = decide(hypothesis(best, 0), hypothesis(rival, 9), 0.95, DecisionParameters())
    assert found == decision
    assert (reason.kind is ReasonKind.RIVAL) == (rival > best / 2)


@pytest.mark.parametrize(
    ("score", "overlap", "decision"),
    [
        (25.0, 0.99, "ambiguous"),
        (25.0, 0.94, "accepted"),  # it would be refused itself
        (33.0, 0.94, "ambiguous"),
    ],
)
def test_a_rival_that_could_not_be_accepted_has_to_be_nearer(
    score: float, overlap: float, decision: str
) -> None:
    best = Hypothesis(np.zeros(3), np.zeros(2), Verdict(40.0, 0.0, 1.0, 0.02, 9.0, 5.0), 0.5)
    verdict = Verdict(score, 0.0, overlap, 0.02, 9.0, 5.0)
    rival = Hypothesis(np.array([9.0, 0, 0]), np.array([9.0, 0]), verdict, 0.5)
    found, _ = decide(best, rival, 0.95, DecisionParameters())
    assert found == decision


@pytest.mark.parametrize(
    ("common", "contradicted", "held", "decision", "why"),
    [
        (5.0, 0.0, 4.5, "refused", ReasonKind.LITTLE_COMMON),
        (40.0, 4.0, 9.0, "refused", ReasonKind.CONTRADICTED),
        (40.0, 0.0, 2.0, "ambiguous", ReasonKind.PARALLEL),
        (40.0, 1.0, 9.0, "accepted", ReasonKind.CONVINCING),
    ],
)
def test_what_is_wrong_with_the_best_hypothesis_decides(
    common: float, contradicted: float, held: float, decision: str, why: ReasonKind
) -> None:
    """Too little wall, a tenth of it seen through, or held in one direction only."""
    overlap = common / (common + contradicted)
    verdict = Verdict(common, contradicted, overlap, 0.02, held, 5.0)
    best = Hypothesis(np.zeros(3), np.zeros(2), verdict, 0.5)
    found, reason = decide(best, None, 0.95, DecisionParameters())
    assert found == decision
    assert reason.kind is why


@pytest.mark.parametrize(
    ("complexity", "held", "decision"),
    [(0.5, 3.0, "accepted"), (0.01, 3.0, "ambiguous"), (0.0, 4.5, "accepted")],
)
def test_straight_walls_tell_places_apart_where_enough_of_them_run_across_the_others(
    complexity: float, held: float, decision: str
) -> None:
    verdict = Verdict(20.0, 0.0, 1.0, 0.02, held, 5.0)
    best = Hypothesis(np.zeros(3), np.zeros(2), verdict, complexity)
    found, reason = decide(best, None, 0.95, DecisionParameters())
    assert found == decision
    assert (reason.kind is ReasonKind.STRAIGHT) == (decision == "ambiguous")


@pytest.mark.parametrize(
    ("rarity", "of_rival", "held", "decision"),
    [
        (65.0, 0.0, 1.6, "accepted"),  # wall ends hold it where walls do not
        (59.0, 0.0, 1.6, "ambiguous"),  # of a million pairs of maps some have as much by chance
        (65.0, 0.0, 1.4, "ambiguous"),  # next to nothing runs across
        (80.0, 55.0, 1.6, "accepted"),
        (80.0, 65.0, 1.6, "ambiguous"),  # as rare elsewhere
        (None, None, 1.6, "ambiguous"),
    ],
)
def test_what_is_rare_needs_less_wall_across_no_other_shape_and_less_of_a_lead(
    rarity: float | None, of_rival: float | None, held: float, decision: str
) -> None:
    """Seven metres of straight wall, four more than a rival has."""
    verdicts = (Verdict(s, 0.0, 1.0, 0.02, held, 5.0) for s in (7.0, 3.0))
    best, rival = (
        Hypothesis(np.array([x, 0.0, 0.0]), np.array([x, 0.0]), verdict, 0.01, bits)
        for x, verdict, bits in zip((0.0, 9.0), verdicts, (rarity, of_rival), strict=True)
    )
    assert decide(best, rival, 0.95, DecisionParameters())[0] == decision


def test_rarity_makes_up_for_no_contradiction_and_for_no_rival() -> None:
    p, sure = DecisionParameters(), 0.99
    best = Hypothesis(np.zeros(3), np.zeros(2), Verdict(40.0, 4.0, 0.9, 0.02, 9.0, 5.0), 0.5, 500.0)
    assert decide(best, None, sure, p)[0] == "refused"
    strong, weak = (Verdict(s, 0.0, 1.0, 0.02, 9.0, 5.0) for s in (40.0, 25.0))
    best = Hypothesis(np.zeros(3), np.zeros(2), strong, 0.5, 500.0)
    rival = Hypothesis(np.array([9.0, 0, 0]), np.array([9.0, 0]), weak, 0.5, 0.0)
    assert decide(best, rival, sure, p)[1].kind is ReasonKind.RIVAL
