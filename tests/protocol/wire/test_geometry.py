from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
import shapely
import shapely.affinity
from hypothesis import example, given, settings
from hypothesis import strategies as st
from shapely.geometry import Polygon, box
from shapely.ops import unary_union

from mapweave.geometry import se2
from mapweave.geometry.arrays import IntArray
from mapweave.maps import LineMap, RobotMap, Submap, Trajectory
from mapweave.scan.free_space import from_rings, rings
from mapweave_protocol.errors import MessageError
from mapweave_protocol.link.assembler import MapAssembler
from mapweave_protocol.wire import geometry
from mapweave_protocol.wire.codec import decode, encode
from mapweave_protocol.wire.coding.outlines import cut_open
from mapweave_protocol.wire.coding.trajectory_code import PER_SECOND
from mapweave_protocol.wire.messages import MapMessage

SEEDS = st.integers(0, 2**32 - 1)


def through_the_wire(robot_map: RobotMap) -> RobotMap:
    arrived = MapAssembler().update(decode(MapMessage, encode(MapMessage.pack(robot_map))))
    assert arrived is not None
    return arrived


def matched(sent: LineMap, arrived: LineMap) -> IntArray:
    """Return which segment of `arrived` each one of `sent` became: they come in another order."""
    away = np.abs(sent.segments[:, None] - arrived.segments[None]).max(axis=2)
    return np.asarray(np.argmin(away, axis=1))


@given(seed=SEEDS)
@settings(max_examples=50, deadline=None)
def test_walls_arrive_within_a_centimetre_polyline_by_polyline(
    random_map: Callable[..., RobotMap], seed: int
) -> None:
    robot_map = random_map(seed)
    for sent, arrived in zip(robot_map.submaps, through_the_wire(robot_map).submaps, strict=True):
        before, after = sent.map, arrived.map
        assert len(after.segments) == len(before.segments)
        if not len(before.segments):
            continue
        became = matched(before, after)
        off = (before.segments - after.segments[became]).reshape(-1, 2)
        assert np.hypot(*off.T).max() <= 0.01
        together = before.polyline[:, None] == before.polyline[None]
        assert np.array_equal(
            together, after.polyline[became][:, None] == after.polyline[became][None]
        )
        support = np.maximum(before.support, 1)
        ratio = np.maximum(after.support[became], 1) / support
        assert (ratio <= 2).all() and (ratio >= 1 / 2).all()
        assert np.array_equal(before.support == 0, after.support[became] == 0)


@given(seed=SEEDS)
@settings(max_examples=50, deadline=None)
def test_scans_arrive_within_two_centimetres_and_a_fifth_of_a_degree(
    random_map: Callable[..., RobotMap], seed: int
) -> None:
    robot_map = random_map(seed)
    for sent, arrived in zip(robot_map.submaps, through_the_wire(robot_map).submaps, strict=True):
        before, after = sent.trajectory, arrived.trajectory
        assert np.array_equal(before.scan_index, after.scan_index)
        assert np.allclose(
            before.stamp, after.stamp, atol=0.501 / PER_SECOND, rtol=0, equal_nan=True
        )
        off = before.pose - after.pose
        assert (np.hypot(off[:, 0], off[:, 1]) <= 0.02).all()
        assert (np.abs(se2.wrap(off[:, 2])) <= np.radians(0.2)).all()
        assert np.allclose(sent.pose[:2], arrived.pose[:2], atol=0.5001e-3)
        assert sent.component == arrived.component


ROOM = np.array([[-3.0, -2.0], [4.0, -2.0], [4.0, 3.0], [-3.0, 3.0]])
PILLARS = [box(x, 0.0, x + 0.9, 1.0) for x in (-2.0, 0.0, 2.0)]


@given(turn=st.floats(-3.0, 3.0), pillars=st.integers(0, 3))
@example(turn=2.6120673646328445, pillars=2)  # a pillar was filled
@settings(max_examples=40, deadline=None)
def test_free_space_arrives_within_what_margin_and_clearance_leave(
    turn: float, pillars: int
) -> None:
    area = shapely.affinity.rotate(
        Polygon(ROOM).difference(unary_union(PILLARS[:pillars])), turn, use_radians=True
    )
    walls = np.array([np.concatenate(ROOM[[k, k - 1]]) for k in range(4)])
    segments = se2.transform_segments(np.array([0.0, 0.0, turn]), walls)
    lines = LineMap(segments, np.arange(4), np.full(4, 3), rings(area))
    submap = Submap(0, 0, np.zeros(3), lines, Trajectory.empty())
    (arrived,) = through_the_wire(RobotMap("a", "b1", 1, (submap,))).submaps
    came = from_rings(arrived.map.free_space)
    wrong = came.symmetric_difference(area)
    # Nothing that was not free is so deep in it that it would count against a wall.
    assert wrong.buffer(-0.2).is_empty
    for ring in arrived.map.free_space:
        assert Polygon(ring).is_valid


def test_segments_too_short_for_the_wire_vanish() -> None:
    lines = LineMap(
        np.array([[0.0, 0.0, 0.001, 0.0], [1.0, 0.0, 4.0, 0.0]]), np.array([0, 1]), np.array([8, 3])
    )
    submap = Submap(0, 0, np.zeros(3), lines, Trajectory.empty())
    (arrived,) = through_the_wire(RobotMap("a", "b1", 1, (submap,))).submaps
    assert arrived.map.support.tolist() == [3]


def test_free_space_whose_holes_cross_its_outline_is_refused() -> None:
    with pytest.raises(ValueError, match="cross"):
        cut_open(np.array([[0, 0], [4, 0], [4, 4], [0, 4]]), [np.array([[2, 2], [9, 2], [2, 3]])])


def a_map_of(walls: int) -> RobotMap:
    """Return a robot's map of parallel walls, each 1800 m long."""
    segments = np.tile([-900.0, 0.0, 900.0, 0.0], (walls, 1))
    segments[:, [1, 3]] = np.linspace(-900, 900, walls)[:, None]
    lines = LineMap(segments, np.arange(walls), np.ones(walls, dtype=np.int64))
    submap = Submap(0, 0, np.zeros(3), lines, Trajectory.empty())
    return RobotMap("a", "b1", 1, (submap,))


def test_a_map_of_more_wall_than_any_robot_maps_is_refused(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Few bytes may claim much wall, and comparing maps costs memory by the metre."""
    decode(MapMessage, encode(MapMessage.pack(a_map_of(50))))
    with monkeypatch.context() as careless:
        careless.setattr(geometry, "MAX_WALL", np.inf)  # a sender that does not check
        forged = encode(MapMessage.pack(a_map_of(60)))
    with pytest.raises(MessageError, match="m of wall"):
        decode(MapMessage, forged)


def test_a_submap_that_is_held_is_the_same_object_in_the_next_message(
    random_map: Callable[..., RobotMap],
) -> None:
    payload = encode(MapMessage.pack(random_map(3)))
    held, again = decode(MapMessage, payload), decode(MapMessage, payload)
    assert len(held.changes.submaps) > 0
    for one, another in zip(held.changes.submaps, again.changes.submaps, strict=True):
        assert one is another


def test_submaps_that_differ_by_a_number_are_not_taken_for_each_other(
    random_map: Callable[..., RobotMap],
) -> None:
    robot_map = random_map(3)
    held = decode(MapMessage, encode(MapMessage.pack(robot_map)))
    last = robot_map.submaps[-1]
    poses = last.trajectory.pose + np.array([1.0, 0.0, 0.0])
    moved = replace(last, trajectory=replace(last.trajectory, pose=poses))
    changed = replace(robot_map, submaps=(*robot_map.submaps[:-1], moved))
    arrived = decode(MapMessage, encode(MapMessage.pack(changed)))
    there = held.changes.submaps[-1].restored.trajectory.pose
    here = arrived.changes.submaps[-1].restored.trajectory.pose
    assert len(here) > 0 and np.allclose(here[:, 0] - there[:, 0], 1.0, atol=0.03)
