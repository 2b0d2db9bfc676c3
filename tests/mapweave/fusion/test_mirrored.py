"""Maps that fit only mirrored are told of, in one sentence, and never joined."""

from typing import get_args

import numpy as np
import pytest
import shapely

from mapweave.fusion.align import FusionParameters, align, align_maps
from mapweave.fusion.mirrored import mirrored, told_if_mirrored
from mapweave.maps import Alignment, Decision, LineMap, RobotMap, Submap, Trajectory
from mapweave.reasons import Reason, ReasonKind
from mapweave.scan.free_space import from_rings
from tests.mapweave.buildings import (
    BUILDING,
    OTHER_BUILDING,
    corridor,
    line_map,
    part,
    random_pose,
    shaken,
    walls_of,
)

WHOLE = part(BUILDING, -1, 31)


def robot(name: str, lines: LineMap) -> RobotMap:
    """Return the map of a robot that saw `lines`, in one piece."""
    return RobotMap(name, "b", 1, (Submap(0, 0, np.zeros(3), lines, Trajectory.empty()),))


def compared(first: LineMap, second: LineMap, seed: int = 1) -> Alignment:
    """Return what comes of two robots' maps, noisy, and in frames of their own."""
    rng = np.random.default_rng(seed)
    (found,) = align(
        robot("a", shaken(first, rng)), robot("b", shaken(second, rng).moved(random_pose(rng)))
    )
    return found


def test_what_is_mirrored_twice_is_as_it_was() -> None:
    twice = mirrored(mirrored(WHOLE))
    np.testing.assert_allclose(twice.segments, WHOLE.segments)
    np.testing.assert_array_equal(twice.polyline, WHOLE.polyline)
    np.testing.assert_array_equal(twice.support, WHOLE.support)
    for ring, was in zip(twice.free_space, WHOLE.free_space, strict=True):
        np.testing.assert_allclose(ring, was)


def test_the_inside_of_a_mirrored_building_is_on_the_left_of_its_walls() -> None:
    turned = mirrored(WHOLE)
    assert (np.diff(turned.polyline) >= 0).all() and turned.polyline[0] == 0
    inside = shapely.Polygon(BUILDING * [1.0, -1.0])
    assert from_rings(turned.free_space).within(inside)
    along = turned.segments[:, 2:] - turned.segments[:, :2]
    left = np.column_stack([-along[:, 1], along[:, 0]]) / np.linalg.norm(along, axis=1)[:, None]
    middle = (turned.segments[:, :2] + turned.segments[:, 2:]) / 2
    assert shapely.contains_xy(inside, *(middle + 1e-3 * left).T).all()


@pytest.mark.parametrize("seed", range(5))
def test_maps_of_one_building_one_of_them_mirrored_are_told_so_and_not_joined(seed: int) -> None:
    found = compared(WHOLE, mirrored(part(BUILDING, 3, 31)), seed)
    assert found.decision == "refused"
    assert found.cause.kind is ReasonKind.MIRRORED
    assert found.cause.found is not None
    assert found.cause.numbers["common"] == pytest.approx(100, abs=15)
    assert found.reason.endswith(
        "one of the sensors seems to hang upside down, or to turn the other way round, and nothing"
        " says so"
    )


@pytest.mark.parametrize(
    ("second", "why"),
    [
        (part(BUILDING, 5, 31), "it fits as it is"),
        (part(OTHER_BUILDING, -1, 27), "it is another building"),
        (mirrored(part(BUILDING, 10, 16)), "it is little"),
    ],
)
def test_other_maps_are_not_called_mirrored(second: LineMap, why: str) -> None:
    assert compared(WHOLE, second).cause.kind is not ReasonKind.MIRRORED, why


def test_plain_rooms_that_are_their_own_mirror_images_are_not_called_mirrored() -> None:
    room = np.array([[0, 0], [14, 0], [14, 9], [0, 9]])
    lines = line_map(walls_of(room), (room + np.sign([7, 4.5] - room) * 0.15,))
    assert compared(lines, lines).cause.kind is not ReasonKind.MIRRORED


# Three rooms that are their own mirror image, and one beside them that is not.
WING = corridor(16.0, below=[(1, 3, 2.5), (4, 7, 4.0), (8, 10, 2.5), (12, 14.5, 1.5)], above=[])


def wings(mirrored_share: float, *, is_image: bool) -> Alignment:
    """Compare a wing with its mirror image, or with a part of itself."""
    first = part(WING, 0.5, 15.5)
    other = mirrored(first) if is_image else part(WING, 0.5, 12.5)
    p = FusionParameters()
    p = p.model_copy(update={"wings": p.wings.model_copy(update={"mirrored": mirrored_share})})
    rng = np.random.default_rng(2)
    return align_maps(("a/0", shaken(first, rng)), ("b/0", shaken(other, rng)), p)


def test_a_wing_and_its_mirror_image_are_not_joined_by_rooms_that_fit_as_they_are() -> None:
    assert wings(1e9, is_image=True).decision == "accepted"
    found = wings(1.25, is_image=True)
    assert found.decision == "ambiguous"
    assert found.cause.kind is ReasonKind.ONE_KIND


def test_a_wing_seen_twice_is_joined_though_its_mirror_image_nearly_fits() -> None:
    assert wings(1.25, is_image=False).decision == "accepted"


NOTHING = Alignment(
    "a/0", "b/0", np.zeros(3), "refused", 0.0, Reason(ReasonKind.LITTLE_COMMON, {"common": 1.0})
)


@pytest.mark.parametrize("decision", get_args(Decision))
def test_it_is_asked_once_and_only_where_nothing_speaks_for_any_pair(decision: Decision) -> None:
    last = Alignment("a/1", "b/0", np.zeros(3), decision, 0.5, NOTHING.cause)
    asked: list[int] = []
    alignments = told_if_mirrored([NOTHING, NOTHING, last], [40, 50, 10], 30.0, asked.append)
    assert asked == ([1] if decision == "refused" else [])
    assert alignments == [NOTHING, NOTHING, last]


def test_small_maps_are_not_asked() -> None:
    asked: list[int] = []
    assert told_if_mirrored([NOTHING], [29.0], 30.0, asked.append) == [NOTHING]
    assert told_if_mirrored([], [], 30.0, asked.append) == []
    assert asked == []
