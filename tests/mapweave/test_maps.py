"""A component is its submaps, each at its pose, side by side."""

import numpy as np
import pytest
from numpy.random import Generator

from mapweave.errors import InvalidComponentError
from mapweave.geometry import se2
from mapweave.maps import LineMap, RobotMap, Submap, Trajectory, component_name, parse_component
from tests.mapweave.buildings import BUILDING, part, random_pose

LEFT, RIGHT = part(BUILDING, 0, 18), part(BUILDING, 8, 30)


def test_a_component_holds_its_submaps_at_their_poses_and_no_others(rng: Generator) -> None:
    """Each submap has a frame of its own; assembled, the building stands where it is."""
    poses = [random_pose(rng) for _ in range(3)]
    submaps = tuple(
        Submap(k, component, pose, lines.moved(se2.inverse(pose)), Trajectory.empty())
        for k, (component, pose, lines) in enumerate(
            zip([0, 4, 0], poses, [LEFT, LEFT, RIGHT], strict=True)
        )
    )
    whole = RobotMap("a", "x", 1, submaps).lines(0)
    np.testing.assert_allclose(
        whole.segments, np.vstack([LEFT.segments, RIGHT.segments]), atol=1e-9
    )
    assert whole.support.tolist() == [*LEFT.support, *RIGHT.support]
    assert len(whole.free_space) == len(LEFT.free_space) + len(RIGHT.free_space)
    np.testing.assert_allclose(whole.free_space[0], LEFT.free_space[0], atol=1e-9)
    assert RobotMap("a", "x", 1, submaps).components == [0, 4]


def test_polylines_stay_apart_when_maps_are_united() -> None:
    united = LineMap.union([LEFT, LineMap.empty(), RIGHT])
    assert len(united.polylines) == len(LEFT.polylines) + len(RIGHT.polylines)
    assert set(np.diff(united.polyline)) == {0, 1}


def test_nothing_united_is_nothing() -> None:
    assert len(LineMap.union([]).segments) == 0
    assert len(RobotMap("a", "x", 1, ()).lines(0).segments) == 0


def test_placing_is_a_rigid_motion_of_all_there_is(rng: Generator) -> None:
    pose = random_pose(rng)
    back = LEFT.moved(pose).moved(se2.inverse(pose))
    np.testing.assert_allclose(back.segments, LEFT.segments, atol=1e-9)
    np.testing.assert_allclose(back.free_space[0], LEFT.free_space[0], atol=1e-9)
    assert back.polyline is LEFT.polyline and back.support is LEFT.support


def test_components_are_named_by_robot_and_number() -> None:
    assert component_name("a", 3) == "a/3"
    assert parse_component("a/3") == ("a", 3)
    assert parse_component("r-1_x/12") == ("r-1_x", 12)


@pytest.mark.parametrize("name", ["", "a", "a/", "/3", "a/b", "a/-1", "a/3 ", "a/²"])
def test_what_names_no_component_is_refused_with_what_was_expected(name: str) -> None:
    with pytest.raises(InvalidComponentError) as caught:
        parse_component(name)
    assert str(caught.value) == (
        f"component {name!r}: expected a robot's id and a number, such as 'a/0'"
    )
