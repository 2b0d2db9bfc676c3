"""A growing submap merges placed scans into lines, in the frame of its first one."""

import numpy as np
import pytest
from numpy.random import Generator
from shapely.geometry import Polygon

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.mapping.submap_builder import SubmapBuilder, SubmapParameters
from mapweave.maps import LineMap
from mapweave.scan.free_space import from_rings
from mapweave.scan.segmentation import extract_segments
from tests.mapweave.buildings import AROUND, cast, rectangle, walls_of

CORNERS = rectangle(0, 0, 6, 4)
PLACES = np.array([[1.0, 1, 0.2], [2, 1.4, 0.9], [3, 2, 2.0], [4, 2.5, 3.0], [5, 3, -2.0]])


def grown(places: FloatArray, rng: Generator) -> SubmapBuilder:
    submap = SubmapBuilder(SubmapParameters())
    for k, place in enumerate(places):
        scan = cast(walls_of(CORNERS), place, index=k, angles=AROUND, noise=rng)
        segments = extract_segments(scan).segments
        submap.add(scan, segments, se2.between(places[0], place))
    return submap


def in_the_room(lines: LineMap) -> FloatArray:
    return se2.transform_segments(PLACES[0], lines.segments)


def test_five_scans_of_a_room_become_its_four_walls(rng: Generator) -> None:
    lines = grown(PLACES, rng).line_map()
    walls = in_the_room(lines)
    long = np.hypot(*(walls[:, 2:] - walls[:, :2]).T) > 1
    assert long.sum() == 4
    apart = np.abs(walls[long][:, None] - walls_of(CORNERS)).max(axis=-1)
    assert sorted(apart.argmin(axis=1)) == [0, 1, 2, 3]
    assert apart.min(axis=1).max() < 0.15
    assert (lines.support[long] == 5).all()


def test_the_free_space_is_the_room_less_a_margin(rng: Generator) -> None:
    lines = grown(PLACES, rng).line_map()
    rings = [se2.transform_points(PLACES[0], ring) for ring in lines.free_space]
    free, room = from_rings(rings), Polygon(CORNERS)
    assert free.difference(room).area == pytest.approx(0, abs=1e-6)
    assert free.area > 0.9 * room.buffer(-0.15).area


def test_the_trajectory_holds_every_scan_at_its_pose_in_order_of_index(rng: Generator) -> None:
    """A scan that waited is added late, and stands where it belongs all the same."""
    submap = SubmapBuilder(SubmapParameters())
    for k in (0, 2, 1):
        scan = cast(walls_of(CORNERS), PLACES[k], index=10 + k, noise=rng)
        submap.add(scan, extract_segments(scan).segments, se2.between(PLACES[0], PLACES[k]))
    trajectory = submap.trajectory()
    assert trajectory.scan_index.tolist() == [10, 11, 12]
    np.testing.assert_allclose(trajectory.stamp, [10.0, 11.0, 12.0])
    np.testing.assert_allclose(trajectory.pose, se2.between(PLACES[0], PLACES[:3]))


@pytest.mark.parametrize(
    ("parameters", "scans"),
    [
        (SubmapParameters(length=2.0), 3),  # steps of 1.08 and 1.17 m
        (SubmapParameters(max_turn=1.5), 3),  # turns of 0.7 and 1.1
        (SubmapParameters(max_scans=4), 4),
        (SubmapParameters(), 6),  # none of these places fill it
    ],
    ids=["path", "turning", "scans", "not yet"],
)
def test_it_is_full_by_path_by_turning_or_by_scans(
    parameters: SubmapParameters, scans: int, rng: Generator
) -> None:
    submap = SubmapBuilder(parameters)
    assert submap.is_empty
    for k, place in enumerate(PLACES):
        scan = cast(walls_of(CORNERS), place, index=k, noise=rng)
        submap.add(scan, extract_segments(scan).segments, place)
        assert not submap.is_empty
        assert submap.is_full == (k + 1 >= scans)


def test_looking_at_the_map_does_not_change_it(rng: Generator) -> None:
    submap = grown(PLACES[:3], rng)
    first, second = submap.line_map(), submap.line_map()
    np.testing.assert_array_equal(first.segments, second.segments)
    assert len(first.free_space) == len(second.free_space)
    np.testing.assert_array_equal(first.free_space[0], second.free_space[0])


def test_where_all_scans_move_alike_all_that_they_saw_moves_with_them(rng: Generator) -> None:
    submap, move = grown(PLACES, rng), np.array([3.0, -2.0, 0.7])
    poses = se2.compose(move, submap.trajectory().pose)
    moved = submap.moved_to(poses)
    np.testing.assert_allclose(moved.trajectory().pose, poses, atol=1e-12)
    expected = se2.transform_segments(move, submap.lines().segments)
    np.testing.assert_allclose(moved.lines().segments, expected, atol=1e-9)
    before, after = (from_rings(each.line_map().free_space) for each in (submap, moved))
    assert after.area == pytest.approx(before.area, rel=0.02)
    assert (submap.trajectory().pose == grown(PLACES, rng).trajectory().pose).all()  # as it was


def test_scans_that_are_put_right_draw_each_wall_once(rng: Generator) -> None:
    """Merged apart, as they were tracked, and drawn where they belong in the end."""
    true = se2.between(PLACES[0], PLACES)
    off = true + np.array([[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0], [-0.1, 0, 0], [0, -0.1, 0]])
    submap = SubmapBuilder(SubmapParameters())
    for k, place in enumerate(PLACES):
        scan = cast(walls_of(CORNERS), place, index=k, angles=AROUND, noise=rng)
        submap.add(scan, extract_segments(scan).segments, off[k])
    walls = in_the_room(submap.moved_to(true).line_map())
    long = walls[np.hypot(*(walls[:, 2:] - walls[:, :2]).T) > 1]
    assert len(long) == 4
    assert np.abs(long[:, None] - walls_of(CORNERS)).max(axis=-1).min(axis=1).max() < 0.15


def test_the_outline_has_the_walls_and_the_free_space_not_simplified(rng: Generator) -> None:
    submap = grown(PLACES, rng)
    outline, lines = submap.outline(), submap.line_map()
    np.testing.assert_array_equal(outline.segments, submap.lines().segments)
    for ring, same in zip(outline.free_space, lines.free_space, strict=True):
        np.testing.assert_array_equal(ring, same)
