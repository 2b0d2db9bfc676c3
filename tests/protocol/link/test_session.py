"""Real sessions through a real router in a process of its own."""

import logging
import math
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from itertools import islice

import pytest
import zenoh

import mapweave_protocol
from mapweave.errors import ArgumentError, InvalidIdError
from mapweave.maps import JointMap, RobotMap
from mapweave_protocol.errors import EndpointError, UnreachableError
from mapweave_protocol.link.asking import ask_joint_maps, ask_latest, ask_robot_map
from mapweave_protocol.link.assembler import MapSender
from mapweave_protocol.link.inbox import Inbox, map_reader, read_presence
from mapweave_protocol.link.session import (
    declare_joint_publisher,
    declare_map_publisher,
    declare_subscriber,
    default_endpoints,
    open_session,
)
from mapweave_protocol.wire import keys
from mapweave_protocol.wire.codec import encode
from mapweave_protocol.wire.messages import JointMapMessage, JointStatusMessage, MapMessage
from mapweave_protocol.wire.queries import JointQuery

MakeMap = Callable[..., RobotMap]
PATIENCE = 20.0  # [s] for what takes milliseconds on a quiet machine


def wait_for(condition: Callable[[], bool]) -> None:
    deadline = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.01)


class Coordinator:
    """Publishes joint maps and answers from what it was told to remember."""

    def __init__(self, session: zenoh.Session, team: str) -> None:
        self.answered = 0
        self._session = session
        self._team = team
        self._remembered: dict[int, bytes] = {}
        self._key = keys.JOINT_QUERY.build(team=team)
        key = keys.JOINT_MAP.build(team=team)
        self._publisher = declare_joint_publisher(session, key)
        self._probe = session.declare_publisher(key)

    def add(self, version: int, *, publish: bool = True) -> None:
        """Remember a version, and publish it."""
        payload = encode(JointMapMessage.pack(JointMap(version, (), ()), series="s1"))
        self._remembered[version] = payload
        if publish:
            self._publisher.put(payload)

    def say(self, status: JointStatusMessage) -> None:
        """Say how far it is."""
        self._session.put(keys.JOINT_STATUS.build(team=self._team), encode(status))

    def is_heard(self) -> bool:
        """Tell whether anybody subscribes to the joint map."""
        # Zenoh's stub says bool; it is an object that is always true.
        return bool(self._probe.matching_status.matching)  # type: ignore[attr-defined]

    def answer(self, query: zenoh.Query) -> None:
        """Answer as the coordinator does."""
        with query:
            asked = JointQuery.parse(str(query.parameters))
            after = max(self._remembered, default=1) - 1 if asked.since is None else asked.since
            for version, payload in sorted(self._remembered.items()):
                if version > after:
                    query.reply(self._key, payload)
        self.answered += 1


@contextmanager
def coordinating(endpoint: str, team: str) -> Iterator[Coordinator]:
    with open_session([endpoint], patience=PATIENCE) as session:
        coordinator = Coordinator(session, team)
        key = keys.JOINT_QUERY.build(team=team)
        with session.declare_queryable(key, coordinator.answer):
            yield coordinator


def versions(endpoint: str, team: str, count: int) -> list[int]:
    joints = mapweave_protocol.joint_maps(team, connect=[endpoint], timeout=PATIENCE)
    return [joint.version for joint in islice(joints, count)]


def test_who_comes_late_gets_the_latest_joint_map(endpoint: str, team: str) -> None:
    with coordinating(endpoint, team) as coordinator:
        for version in (1, 2, 3):
            coordinator.add(version)
        assert versions(endpoint, team, 1) == [3]


def test_what_is_only_in_the_store_is_asked_for(endpoint: str, team: str) -> None:
    """As after a restart of the coordinator: its cache is empty, its store is not."""
    with coordinating(endpoint, team) as coordinator:
        coordinator.add(8, publish=False)
        assert versions(endpoint, team, 1) == [8]


def test_who_listens_from_the_start_gets_every_version_also_those_that_were_lost(
    endpoint: str, team: str
) -> None:
    with coordinating(endpoint, team) as coordinator, ThreadPoolExecutor() as pool:
        heard = pool.submit(versions, endpoint, team, 6)
        wait_for(lambda: coordinator.answered > 0)
        for version in range(1, 7):
            coordinator.add(version, publish=version not in (1, 4))
        assert heard.result(PATIENCE) == [1, 2, 3, 4, 5, 6]


def test_a_version_that_never_arrived_is_asked_for_when_the_coordinator_tells_of_it(
    endpoint: str, team: str
) -> None:
    said = JointStatusMessage(boot="c", stamp=0.0, series="s1", version=2, pending=False)
    with coordinating(endpoint, team) as coordinator, ThreadPoolExecutor() as pool:
        coordinator.add(1)
        heard = pool.submit(versions, endpoint, team, 2)
        wait_for(lambda: coordinator.answered > 0)
        coordinator.add(2, publish=False)
        while not heard.done():
            coordinator.say(said)
            time.sleep(0.1)
        assert heard.result() == [1, 2]


def test_who_listens_before_there_is_a_coordinator_misses_nothing(endpoint: str, team: str) -> None:
    asked: list[str] = []

    def hear(query: zenoh.Query) -> None:
        with query:
            asked.append(str(query.parameters))

    with (
        open_session([endpoint], patience=PATIENCE) as bystander,
        ThreadPoolExecutor() as pool,
    ):
        with bystander.declare_queryable(keys.JOINT_QUERY.build(team=team), hear):
            heard = pool.submit(versions, endpoint, team, 5)
            wait_for(lambda: len(asked) > 0)
        with coordinating(endpoint, team) as coordinator:
            for version in range(1, 6):
                coordinator.add(version)
            assert heard.result(PATIENCE) == [1, 2, 3, 4, 5]


def test_closing_the_generator_closes_its_session(endpoint: str, team: str) -> None:
    with coordinating(endpoint, team) as coordinator:
        coordinator.add(1)
        joints = mapweave_protocol.joint_maps(team, connect=[endpoint], timeout=PATIENCE)
        assert next(joints).version == 1
        wait_for(coordinator.is_heard)
        joints.close()  # type: ignore[attr-defined]
        wait_for(lambda: not coordinator.is_heard())


def test_a_generator_ends_when_nothing_comes_for_so_long(endpoint: str, team: str) -> None:
    assert list(mapweave_protocol.statuses(team, connect=[endpoint], timeout=0.2)) == []


def test_who_comes_late_gets_the_latest_map_of_each_robot(
    endpoint: str, team: str, random_map: MakeMap
) -> None:
    with open_session([endpoint], patience=PATIENCE) as session:
        publishers = {
            robot: declare_map_publisher(session, keys.MAP.build(team=team, robot=robot))
            for robot in "ab"
        }
        for robot, publisher in publishers.items():
            sender = MapSender()
            for version in range(1, 100):
                publisher.put(sender.payload(random_map(1, 2, robot=robot, version=version)))
        maps = mapweave_protocol.robot_maps(team, connect=[endpoint], timeout=PATIENCE)
        latest: dict[str, int] = {}
        for robot_map in maps:
            latest[robot_map.robot] = robot_map.version
            if latest == {"a": 99, "b": 99}:
                break
        assert latest == {"a": 99, "b": 99}


def test_hostile_payloads_are_counted_and_warned_of_once_and_the_rest_still_arrives(
    endpoint: str, team: str, random_map: MakeMap, caplog: pytest.LogCaptureFixture
) -> None:
    key = keys.MAP.build(team=team, robot="a")
    as_another = encode(MapMessage.pack(random_map(1, robot="b")))
    good = encode(MapMessage.pack(random_map(1, robot="a")))
    inbox, reader = Inbox(), map_reader()
    with (
        open_session([endpoint], patience=PATIENCE) as robot,
        open_session([endpoint], patience=PATIENCE) as listener,
        declare_subscriber(listener, keys.MAP.pattern(team=team), inbox.put, history=64),
        declare_map_publisher(robot, key) as publisher,
        caplog.at_level(logging.WARNING),
    ):
        for payload in (b"", b"\xc1", bytes(1000), as_another, good[:-1], good):
            publisher.put(payload)
        accepted = []
        for _ in range(6):  # what was put before the link stood may come after what was put later
            arrival = inbox.get(PATIENCE)
            assert arrival is not None
            accepted += [message.robot for message in [reader.read(arrival)] if message is not None]
    assert accepted == ["a"]
    assert reader.refused == 5
    assert len([record for record in caplog.records if "refused" in record.message]) == 1


def test_a_token_tells_that_a_robot_comes_and_goes(endpoint: str, team: str) -> None:
    inbox = Inbox()
    with open_session([endpoint], patience=PATIENCE) as listener:
        live = listener.liveliness()
        with live.declare_subscriber(keys.LIVE.pattern(team=team), inbox.put, history=True):
            with open_session([endpoint], patience=PATIENCE) as robot:
                key = keys.LIVE.build(team=team, robot="a", boot="b1")
                with robot.liveliness().declare_token(key):
                    here = inbox.get(PATIENCE)
            gone = inbox.get(PATIENCE)
    presences = [read_presence(arrival) for arrival in (here, gone) if arrival is not None]
    assert [(p.robot, p.boot, p.here) for p in presences if p] == [
        ("a", "b1", True),
        ("a", "b1", False),
    ]


def test_a_question_that_nobody_answers_is_answered_by_nothing(endpoint: str, team: str) -> None:
    with open_session([endpoint], patience=PATIENCE) as session:
        assert ask_joint_maps(session, team, JointQuery()) == []
        assert ask_robot_map(session, team, "a") is None


def test_a_full_inbox_drops_the_oldest(endpoint: str, team: str) -> None:
    inbox = Inbox(capacity=3)
    taken: list[bytes] = []

    def take(sample: zenoh.Sample) -> None:
        inbox.put(sample)
        taken.append(sample.payload.to_bytes())

    key = keys.STATUS.build(team=team, robot="a")
    with (
        open_session([endpoint], patience=PATIENCE) as session,
        session.declare_subscriber(key, take),
    ):
        for number in range(10):
            session.put(key, str(number))
        wait_for(lambda: len(taken) == 10)
    arrivals = [inbox.get(0.0) for _ in range(4)]
    assert [arrival and arrival.payload for arrival in arrivals] == [b"7", b"8", b"9", None]


@pytest.mark.parametrize(
    "address",
    ["localhost:7447", "tcp/localhost", "foo/localhost:1", "", "*", "tcp/localhost:65536"],
)
def test_what_is_no_endpoint_is_refused_at_once(address: str) -> None:
    with pytest.raises(EndpointError), open_session([address]):
        pass


@pytest.mark.parametrize("endpoints", [[], [7447], [None]])
def test_no_endpoint_at_all_is_refused_at_once(endpoints: list[str]) -> None:
    with pytest.raises(EndpointError, match=r"^endpoint .+: expected"), open_session(endpoints):
        pass


def test_one_endpoint_needs_no_list() -> None:
    with (
        pytest.raises(UnreachableError, match=r"at tcp/127\.0\.0\.1:9 "),
        open_session("tcp/127.0.0.1:9", patience=0.0),
    ):
        pass


@pytest.mark.parametrize("timeout", [0.0, -1.0, math.nan, "soon"])
def test_silence_is_waited_for_longer_than_not_at_all(timeout: float) -> None:
    with pytest.raises(ArgumentError, match=r"^timeout: expected more than 0 s"):
        next(mapweave_protocol.statuses("rescue", timeout=timeout))


def test_a_router_that_does_not_answer_is_named_after_the_patience() -> None:
    waits: list[str] = []
    with (
        pytest.raises(UnreachableError, match=r"tcp/127\.0\.0\.1:9 "),
        open_session(["tcp/127.0.0.1:9"], patience=1.5, on_wait=waits.append),
    ):
        pass
    assert waits == ["tcp/127.0.0.1:9: refused: nothing listens there"]


def test_a_team_whose_name_is_no_id_is_refused() -> None:
    with pytest.raises(InvalidIdError):
        next(mapweave_protocol.joint_maps("No Team"))


def test_the_environment_names_the_router(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MAPWEAVE_CONNECT", "tcp/one:1, tcp/two:2")
    assert default_endpoints() == ("tcp/one:1", "tcp/two:2")
    monkeypatch.delenv("MAPWEAVE_CONNECT")
    assert default_endpoints() == ("tcp/localhost:7447",)


def test_a_coordinator_that_stands_still_has_not_answered(endpoint: str, team: str) -> None:
    # It may have joint maps: who took it for one that has none would count from 1.
    asked: list[zenoh.Query] = []
    key = keys.JOINT_QUERY.build(team=team)
    with (
        open_session([endpoint]) as coordinator,
        open_session([endpoint]) as session,
        coordinator.declare_queryable(key, asked.append),
    ):
        wait_for(lambda: ask_latest(session, team, 0.2) == (None, False) and bool(asked))
