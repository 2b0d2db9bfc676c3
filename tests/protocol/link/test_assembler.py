from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapweave.maps import LineMap, RobotMap, Submap, Trajectory
from mapweave_protocol.link.assembler import (
    MESSAGES_TO_COMPLETE,
    REMEMBERED_BOOTS,
    MapAssembler,
    MapSender,
)
from mapweave_protocol.wire.codec import decode, encode
from mapweave_protocol.wire.messages import MapMessage

MakeMap = Callable[..., RobotMap]


def drive(random_map: MakeMap, rng: np.random.Generator, versions: int) -> list[RobotMap]:
    """Return the versions of a map: the last submap changes, others are added, poses move."""
    finished: list[Submap] = []
    maps = []
    for version in range(1, versions + 1):
        growing = random_map(int(rng.integers(2**31)), len(finished) + 1).submaps[-1]
        submaps = [replace(s, pose=s.pose + rng.normal(0, 0.1, 3)) for s in (*finished, growing)]
        maps.append(RobotMap("a", "b1", version, tuple(submaps)))
        if rng.random() < 0.4:
            finished.append(growing)
    return maps


def same(arrived: RobotMap, sent: RobotMap) -> bool:
    """Tell whether `arrived` is what a single message of `sent` gives."""
    alone = MapAssembler().update(MapMessage.pack(sent))
    return alone is not None and plain(arrived) == plain(alone)


def plain(robot_map: RobotMap) -> list[object]:
    return [
        (s.id, s.component, s.pose.tolist(), s.map.segments.tolist(), s.map.polyline.tolist(),
         s.map.support.tolist(), [ring.tolist() for ring in s.map.free_space],
         s.trajectory.scan_index.tolist(), s.trajectory.pose.tolist(),
         str(s.trajectory.stamp.tolist()))
        for s in robot_map.submaps
    ]  # fmt: skip


def sent_by(maps: list[RobotMap]) -> list[MapMessage]:
    sender = MapSender()
    return [decode(MapMessage, sender.payload(robot_map)) for robot_map in maps]


def test_a_whole_map_is_the_same_bytes_whatever_of_it_was_coded_before(random_map: MakeMap) -> None:
    sender = MapSender()
    for robot_map in drive(random_map, np.random.default_rng(5), 12):
        assert sender.whole(robot_map) == encode(MapMessage.pack(robot_map))


def test_a_sender_knows_its_map_as_it_arrives(random_map: MakeMap) -> None:
    sender, assembler = MapSender(), MapAssembler()
    for robot_map in drive(random_map, np.random.default_rng(3), 6):
        arrived = assembler.update(decode(MapMessage, sender.payload(robot_map)))
        assert arrived is not None
        assert plain(sender.as_sent(robot_map)) == plain(arrived)


@given(st.integers(0, 2**31), st.data())
@settings(max_examples=25, deadline=None)
def test_whatever_is_lost_or_late_no_wrong_map_is_put_together(
    random_map: MakeMap, seed: int, data: st.DataObject
) -> None:
    maps = drive(random_map, np.random.default_rng(seed), 12)
    stream = data.draw(st.lists(st.sampled_from(sent_by(maps)), max_size=20))
    assembler = MapAssembler()
    versions = []
    for message in stream:
        robot_map = assembler.update(message)
        if robot_map is not None:
            assert same(robot_map, maps[robot_map.version - 1])
            versions.append(robot_map.version)
    assert versions == sorted(set(versions))


@given(st.integers(0, 2**31))
@settings(max_examples=20, deadline=None)
def test_if_nothing_is_lost_every_version_is_put_together(random_map: MakeMap, seed: int) -> None:
    maps = drive(random_map, np.random.default_rng(seed), 12)
    assembler = MapAssembler()
    for robot_map, message in zip(maps, sent_by(maps), strict=True):
        arrived = assembler.update(message)
        assert arrived is not None and same(arrived, robot_map)


@given(st.integers(0, 2**31))
@settings(max_examples=30, deadline=None)
def test_once_everything_arrived_in_whatever_order_the_latest_is_there(
    random_map: MakeMap, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    maps = drive(random_map, rng, 12)
    messages = sent_by(maps)
    stream = [messages[k] for k in rng.permutation(len(messages))]
    assembler = MapAssembler()
    arrived = [robot_map for message in stream if (robot_map := assembler.update(message))]
    assert arrived[-1].version == 12
    assert same(arrived[-1], maps[-1])
    assert not assembler.missing("a")


@given(st.integers(0, 2**31), st.data())
@settings(max_examples=30, deadline=None)
def test_a_complete_message_is_enough(random_map: MakeMap, seed: int, data: st.DataObject) -> None:
    maps = drive(random_map, np.random.default_rng(seed), 8)
    stream = sent_by(maps)
    assembler = MapAssembler()
    for message in data.draw(st.lists(st.sampled_from(stream[:-1]), max_size=5)):
        assembler.update(message)
    arrived = assembler.update(MapMessage.pack(maps[-1]))
    assert arrived is not None and same(arrived, maps[-1])


def test_a_growing_submap_whose_last_form_was_lost_is_missed_until_it_comes(
    random_map: MakeMap,
) -> None:
    first, other = random_map(1, 1).submaps[0], random_map(2, 1).submaps[0]
    later = random_map(3, 2).submaps[1]
    maps = [
        RobotMap("a", "b1", 1, (first,)),
        RobotMap("a", "b1", 2, (other,)),
        RobotMap("a", "b1", 3, (other, later)),
    ]
    stream = sent_by(maps)
    assembler = MapAssembler()
    assert assembler.update(stream[0]) is not None
    assert assembler.update(stream[2]) is None
    assert assembler.missing("a")
    arrived = assembler.update(stream[1])
    assert arrived is not None and same(arrived, maps[2])


def test_what_did_not_change_is_not_sent_again(random_map: MakeMap) -> None:
    whole = random_map(1, 20)
    moved = replace(
        whole, version=2, submaps=(replace(whole.submaps[0], pose=np.ones(3)), *whole.submaps[1:])
    )
    messages = sent_by([whole, moved])
    assert [message.complete for message in messages] == [True, False]
    assert messages[1].changes.submaps == ()


def test_a_submap_that_stays_as_it_is_costs_nothing_once_it_was_sent(random_map: MakeMap) -> None:
    sender = MapSender()
    submaps = random_map(1, 20).submaps
    sender.payload(RobotMap("a", "b1", 1, submaps))
    moved = (replace(submaps[0], pose=submaps[0].pose + 0.5), *submaps[1:])
    assert len(sender.payload(RobotMap("a", "b1", 2, moved))) < 60


def test_a_submap_that_is_no_longer_part_of_the_map_goes(random_map: MakeMap) -> None:
    whole = random_map(1, 3)
    less = replace(whole, version=2, submaps=(whole.submaps[0], whole.submaps[2]))
    assembler = MapAssembler()
    arrived = [assembler.update(message) for message in sent_by([whole, less])]
    assert arrived[1] is not None and [s.id for s in arrived[1].submaps] == [0, 2]


def test_a_cache_of_that_many_messages_always_holds_a_complete_one(random_map: MakeMap) -> None:
    whole = random_map(1, 30)
    changing = [
        replace(
            whole,
            version=version,
            submaps=(
                *whole.submaps[:-1],
                replace(whole.submaps[-1], pose=np.array([version, 0.0, 0.0])),
            ),
        )
        for version in range(1, 200)
    ]
    complete = [message.complete for message in sent_by(changing)]
    for start in range(len(complete) - MESSAGES_TO_COMPLETE):
        assert any(complete[start : start + MESSAGES_TO_COMPLETE])


def test_a_large_map_is_repeated_after_so_many_messages_however_little_changes() -> None:
    """Each message is a few dozen bytes, the whole is thousands: bytes are no reason."""
    rng = np.random.default_rng(1)
    starts = rng.uniform(-900, 900, (1000, 2))
    segments = np.hstack([starts, starts + rng.uniform(0.5, 1.0, starts.shape)])
    lines = LineMap(segments, np.arange(len(segments)), np.ones(len(segments), dtype=np.int64))
    submap = Submap(0, 0, np.zeros(3), lines, Trajectory.empty())
    sender = MapSender()
    sizes = [
        len(sender.payload(RobotMap("a", "b1", k, (replace(submap, pose=np.full(3, 1e-3 * k)),))))
        for k in range(1, MESSAGES_TO_COMPLETE + 2)
    ]
    whole = [k for k, size in enumerate(sizes) if size > 1e3]
    assert whole == [0, MESSAGES_TO_COMPLETE]


def test_another_run_of_a_robot_starts_from_nothing_and_the_old_one_goes_on(
    random_map: MakeMap,
) -> None:
    maps = [
        random_map(1, version=50),
        random_map(2, boot="b2", version=1),
        random_map(3, version=51),
    ]
    assembler = MapAssembler()
    for robot_map in maps:
        arrived = assembler.update(MapMessage.pack(robot_map))
        assert arrived is not None and same(arrived, robot_map)
    assert assembler.update(MapMessage.pack(maps[0])) is None


def test_of_too_many_runs_the_one_unheard_for_longest_is_forgotten(random_map: MakeMap) -> None:
    maps = [random_map(1, boot=f"b{number}") for number in range(REMEMBERED_BOOTS + 1)]
    assembler = MapAssembler()
    arrived = [assembler.update(MapMessage.pack(robot_map)) for robot_map in [*maps, *maps[:2]]]
    assert [robot_map is not None for robot_map in arrived] == [True] * len(maps) + [True, True]
    assert assembler.update(MapMessage.pack(maps[-1])) is None


def test_robots_do_not_mix(random_map: MakeMap) -> None:
    assembler = MapAssembler()
    maps = [random_map(seed, robot=robot) for seed, robot in enumerate("abc")]
    for robot_map in maps:
        arrived = assembler.update(MapMessage.pack(robot_map))
        assert arrived is not None and same(arrived, robot_map)


def test_unchanged_submaps_keep_their_objects(random_map: MakeMap) -> None:
    maps = drive(random_map, np.random.default_rng(5), 6)
    assembler = MapAssembler()
    before: dict[int, Submap] = {}
    kept = 0
    for message in sent_by(maps):
        arrived = assembler.update(message)
        assert arrived is not None
        resent = {submap.id for submap in message.changes.submaps}
        for submap in arrived.submaps:
            if submap.id in before and submap.id not in resent:
                assert submap.map is before[submap.id].map
                kept += 1
        before = {submap.id: submap for submap in arrived.submaps}
    assert kept > 0


def test_a_complete_message_that_says_nothing_new_keeps_the_objects(random_map: MakeMap) -> None:
    """What was computed from a submap need not be computed again."""
    robot_map = random_map(3, 4)
    assembler = MapAssembler()
    first = assembler.update(decode(MapMessage, MapSender().payload(robot_map)))
    later = replace(robot_map, version=robot_map.version + 1)
    again = assembler.update(decode(MapMessage, MapSender().payload(later)))
    assert first is not None and again is not None and again.version == later.version
    assert [s.map for s in again.submaps] == [s.map for s in first.submaps]


@pytest.mark.parametrize("submaps", [0, 1])
def test_a_map_of_next_to_nothing_travels_too(random_map: MakeMap, submaps: int) -> None:
    robot_map = random_map(1, submaps)
    arrived = MapAssembler().update(decode(MapMessage, MapSender().payload(robot_map)))
    assert arrived is not None and same(arrived, robot_map)
