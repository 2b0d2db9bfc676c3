"""Where a robot says that it is."""

import logging

import numpy as np
import pytest

from mapweave.geometry import se2
from mapweave.mapping.placement import Placement
from mapweave.maps import Alignment, Decision, JointComponent, JointMap, LineMap
from mapweave.reasons import Reason
from mapweave.scan.scan import Scan
from mapweave_agent.live.whereabouts import Whereabouts, covariance_of
from mapweave_protocol.wire.joint_status_message import frames_of
from mapweave_protocol.wire.messages import AlignmentMessage, JointStatusMessage, MapVersion

POSE = np.array([3.0, 1.0, 0.4])
UNCERTAINTY = np.array([0.3, 0.02, 0.01, 0.0])  # along x
NOTHING = LineMap(np.zeros((0, 4)), np.zeros(0, int), np.zeros(0, int), ())


def scan(index: int, stamp: float = 5.0) -> Scan:
    return Scan([1.0, 1.0], [0.0, 0.1], index, stamp)


def placed(pose: np.ndarray | None = POSE, component: int = 0) -> Placement:
    uncertainty = None if pose is None else UNCERTAINTY
    return Placement(pose is not None, component, False, False, pose, uncertainty)


def joint(version: int, *components: dict[str, list[float]]) -> JointStatusMessage:
    """Return the status of a coordinator whose joint map has these components."""
    made = [
        JointComponent({n: np.array(p) for n, p in one.items()}, 1.0, NOTHING, np.zeros(0))
        for one in components
    ]
    return JointStatusMessage(
        boot="c",
        stamp=0.0,
        series="s",
        version=version,
        pending=False,
        frames=frames_of(JointMap(version, tuple(made), ())),
    )


@pytest.mark.parametrize("stamp", [1e11, -1e11, 1e12, 1e308, float("nan")])
def test_whatever_its_clock_says_a_robot_says_where_it_is(stamp: float) -> None:
    message = Whereabouts("b", "boot", 0).message(scan(7, stamp), placed(), 5.0)
    assert message is not None
    assert message.stamp == (stamp if abs(stamp) <= 1e11 else None)


def test_before_the_joint_map_has_its_component_a_robot_is_in_its_own_map_only() -> None:
    message = Whereabouts("r1", "b", 4).message(scan(7), placed(), 9.0)
    assert message is not None
    assert (message.component, message.scan_index, message.stamp) == ("r1/4", 7, 5.0)
    assert message.pose == tuple(POSE)
    assert message.joint is None


def test_once_joined_it_is_in_the_joint_frame_too_and_its_covariance_is_turned() -> None:
    whereabouts = Whereabouts("r2", "b", 0)
    whereabouts.coordinator(joint(3, {"r1/0": [0, 0, 0], "r2/0": [10.0, 5.0, np.pi / 2]}))
    message = whereabouts.message(scan(0), placed(), 0.0)
    assert message is not None
    assert message.joint is not None
    assert (message.joint.frame, message.joint.since) == ("r1/0", 3)
    np.testing.assert_allclose(message.joint.pose, [9.0, 8.0, 0.4 + np.pi / 2], atol=1e-6)
    expected = np.diag([0.02**2, 0.3**2, 0.01**2])
    np.testing.assert_allclose(message.covariance_matrix(joint=True), expected, atol=1e-5)


def test_at_a_merge_and_at_an_unmerge_the_frame_changes_once_and_it_is_said(
    caplog: pytest.LogCaptureFixture,
) -> None:
    caplog.set_level(logging.INFO)
    whereabouts, frames = Whereabouts("r2", "b", 0), []
    apart = {"r2/0": [0.0, 0.0, 0.0]}
    together = {"r1/0": [0.0, 0.0, 0.0], "r2/0": [1.0, 0.0, 0.0]}
    for version, component in enumerate((apart, apart, together, together, apart, apart), start=1):
        for _ in range(3):  # a coordinator says the same once a second
            whereabouts.coordinator(joint(version, component))
            message = whereabouts.message(scan(0), placed(), 0.0)
            assert message is not None
            assert message.joint is not None
            frames.append((message.joint.frame, message.joint.since))
    assert list(dict.fromkeys(frames)) == [("r2/0", 1), ("r1/0", 3), ("r2/0", 5)]
    assert [record.getMessage() for record in caplog.records] == [
        "r2/0 is in the frame of r1/0 from version 3 on",
        "r2/0 is in its own frame again from version 5 on",
    ]


def test_a_component_that_the_joint_map_no_longer_has_is_in_no_joint_frame() -> None:
    whereabouts = Whereabouts("r2", "b", 0)
    whereabouts.coordinator(joint(1, {"r2/0": [0.0, 0.0, 0.0]}))
    whereabouts.coordinator(joint(2, {"r1/0": [0.0, 0.0, 0.0]}))
    message = whereabouts.message(scan(0), placed(), 0.0)
    assert message is not None
    assert message.joint is None


def meeting(decision: Decision = "accepted") -> AlignmentMessage:
    """Return how r2/0 lies to r1/0, which r1 has found."""
    first, second = (MapVersion(robot=robot, boot="b", version=1) for robot in ("r1", "r2"))
    turned = np.array([10.0, 5.0, np.pi / 2])
    found = Alignment("r1/0", "r2/0", turned, decision, 0.9, Reason.words("so"))
    return AlignmentMessage.pack("r1", first, second, [found])


def frame_of(whereabouts: Whereabouts) -> tuple[str, int, tuple[float, ...]] | None:
    message = whereabouts.message(scan(0), placed(), 0.0)
    assert message is not None
    joint = message.joint
    if joint is None:
        return None
    return joint.frame, joint.since, tuple(round(number, 9) for number in joint.pose)


def test_without_a_coordinator_two_robots_that_met_are_in_the_frame_of_the_first_of_them() -> None:
    first, second = Whereabouts("r1", "b", 0), Whereabouts("r2", "b", 0)
    for each in (first, second):
        each.met(meeting())
    assert frame_of(first) == ("r1/0", 0, tuple(POSE))
    where = frame_of(second)
    assert where is not None
    assert where[:2] == ("r1/0", 0)
    np.testing.assert_allclose(where[2], [9.0, 8.0, 0.4 + np.pi / 2], atol=1e-5)
    second.met(meeting("refused"))
    assert frame_of(second) is None


def test_who_met_in_another_run_is_nowhere_in_a_partners_frame() -> None:
    whereabouts = Whereabouts("r2", "later", 0)
    whereabouts.met(meeting())
    assert frame_of(whereabouts) is None


def test_what_a_coordinator_said_stands_when_it_left_but_that_a_robot_is_alone() -> None:
    whereabouts = Whereabouts("r2", "b", 0)
    whereabouts.met(meeting())
    whereabouts.coordinator(joint(3, {"r2/0": [0.0, 0.0, 0.0]}))
    assert frame_of(whereabouts) == ("r2/0", 3, tuple(POSE))
    whereabouts.coordinator_here("c", here=False)
    assert (frame_of(whereabouts) or ())[:2] == ("r1/0", 0)
    whereabouts.coordinator_here("c", here=True)
    whereabouts.coordinator(joint(4, {"r0/0": [0.0, 0.0, 0.0], "r2/0": [0.0, 0.0, 0.0]}))
    whereabouts.coordinator_here("c", here=False)
    assert frame_of(whereabouts) == ("r0/0", 4, tuple(POSE))


def test_of_two_coordinators_the_first_one_tells_the_frame_until_it_has_left() -> None:
    whereabouts = Whereabouts("r2", "b", 0)
    one = joint(3, {"r1/0": [0.0, 0.0, 0.0], "r2/0": [0.0, 0.0, 0.0]})
    other = joint(1, {"r2/0": [0.0, 0.0, 0.0]}).model_copy(update={"boot": "d"})
    for status in (one, other, one, other):
        whereabouts.coordinator(status)
        assert frame_of(whereabouts) == ("r1/0", 3, tuple(POSE))
    whereabouts.coordinator_here("c", here=False)
    for status in (one, other, one):  # a last word may come late
        whereabouts.coordinator(status)
    assert frame_of(whereabouts) == ("r2/0", 1, tuple(POSE))


def test_while_a_scan_fits_nowhere_the_last_pose_stands_and_says_so() -> None:
    whereabouts = Whereabouts("r1", "b", 0)
    assert whereabouts.message(scan(0), placed(None), 0.0) is None
    whereabouts.message(scan(1), placed(), 0.0)
    message = whereabouts.message(scan(2, np.nan), placed(None), 0.0)
    assert message is not None
    assert (message.found, message.pose, message.scan_index) == (False, tuple(POSE), 2)
    assert message.stamp is None


@pytest.mark.parametrize("turn", [0.0, 0.7, -1.2])
def test_a_covariance_has_its_deviations_along_and_across_its_direction(turn: float) -> None:
    covariance = covariance_of(np.array([0.3, 0.02, 0.01, turn]))
    along, across = se2.rotation(turn).T
    assert along @ covariance[:2, :2] @ along == pytest.approx(0.3**2)
    assert across @ covariance[:2, :2] @ across == pytest.approx(0.02**2)
