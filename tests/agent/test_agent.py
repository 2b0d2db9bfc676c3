"""``mapweave agent`` as real processes around a real router."""

import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
import zenoh

import mapweave_protocol
from mapweave.cli import EXIT_FAILED, EXIT_USAGE, main
from mapweave.io.readers import read_scans
from mapweave.mapping.mapper import Mapper
from mapweave.maps import RobotMap
from mapweave_agent.publication_schedule import AgentParameters
from mapweave_protocol.link.asking import ask_robot_map
from mapweave_protocol.link.assembler import MESSAGES_TO_COMPLETE, MapAssembler, MapSender
from mapweave_protocol.link.inbox import (
    Inbox,
    alignment_reader,
    map_reader,
    read_presence,
    status_reader,
)
from mapweave_protocol.link.session import declare_map_publisher, declare_subscriber, open_session
from mapweave_protocol.link.status_schedule import AGAIN
from mapweave_protocol.wire import keys
from mapweave_protocol.wire.messages import AlignmentMessage, StatusMessage
from mapweave_protocol.wire.pairs import responsible

MAPWEAVE = Path(sys.executable).with_name("mapweave")
PATIENCE = 60.0  # [s]
STATUS = AgentParameters().status_interval
SCANS = 40
FIRST = responsible("a", "b")
SECOND = "b" if FIRST == "a" else "a"


class Listener:
    """Hears a team, and keeps the last of each."""

    def __init__(self, session: zenoh.Session, team: str) -> None:
        self.maps: dict[str, RobotMap] = {}
        self.statuses: dict[str, StatusMessage] = {}
        self.alignments: list[AlignmentMessage] = []
        self.here: set[str] = set()
        self._readers = map_reader(), status_reader(), alignment_reader()
        self._assembler = MapAssembler()
        self._inbox = Inbox()
        put = self._inbox.put
        live = session.liveliness().declare_subscriber(
            keys.LIVE.pattern(team=team), put, history=True
        )
        self._subscribers = [
            live,
            declare_subscriber(session, keys.MAP.pattern(team=team), put, history=64),
            declare_subscriber(session, keys.STATUS.pattern(team=team), put),
            declare_subscriber(session, keys.ALIGNMENT.pattern(team=team), put),
        ]

    def until(self, condition: Callable[[], bool]) -> None:
        """Listen until `condition`, or fail."""
        deadline = time.monotonic() + PATIENCE
        while not condition():
            assert time.monotonic() < deadline, self.statuses
            self._hear()

    def finished(self, robot: str) -> bool:
        """Tell whether `robot` says that it has finished, and its last map is here."""
        status = self.statuses.get(robot)
        known = self.maps.get(robot)
        return (
            status is not None
            and status.state == "finished"
            and known is not None
            and known.version == status.map_version
        )

    def _hear(self) -> None:
        arrival = self._inbox.get(0.05)
        if arrival is None:
            return
        presence = read_presence(arrival)
        maps, statuses, alignments = self._readers
        if presence is not None:
            (self.here.add if presence.here else self.here.discard)(presence.robot)
        elif maps.reads(arrival) and (message := maps.read(arrival)):
            robot_map = self._assembler.update(message)
            if robot_map is not None:
                self.maps[robot_map.robot] = robot_map
        elif statuses.reads(arrival) and (status := statuses.read(arrival)):
            self.statuses[status.robot] = status
        elif alignments.reads(arrival) and (found := alignments.read(arrival)):
            self.alignments.append(found)


@contextmanager
def agent(robot: str, log: Path, team: str, endpoint: str) -> Iterator[subprocess.Popen[bytes]]:
    command = [str(MAPWEAVE), "agent", "--robot", robot, "--log", str(log), "--rate", "max"]
    where = ["--scans", f"0:{SCANS}", "--team", team, "--connect", endpoint]
    with subprocess.Popen([*command, *where]) as process:
        try:
            yield process
        finally:
            process.terminate()


def mapped(robot: str, log: Path, scans: int = SCANS) -> RobotMap:
    mapper = Mapper(robot, "x")
    for number, scan in enumerate(read_scans(log, on_warning=pytest.fail)):
        if number < scans:
            mapper.add(scan)
    return mapper.robot_map()


def test_two_robots_map_and_the_responsible_one_compares_their_last_maps(
    endpoint: str, team: str, logs: list[Path]
) -> None:
    with open_session([endpoint], patience=PATIENCE) as session:
        listener = Listener(session, team)
        with (
            agent("a", logs[0], team, endpoint) as a,
            agent("b", logs[1], team, endpoint) as b,
        ):
            listener.until(lambda: listener.finished("a") and listener.finished("b"))
            last = {robot: listener.maps[robot] for robot in "ab"}

            def compared() -> bool:
                said = listener.statuses[FIRST].compared.get(SECOND)
                return said is not None and (
                    (said.own_version, said.peer_boot, said.peer_version)
                    == (last[FIRST].version, last[SECOND].boot, last[SECOND].version)
                )

            listener.until(compared)
            a.send_signal(signal.SIGINT)
            b.send_signal(signal.SIGTERM)
            assert (a.wait(PATIENCE), b.wait(PATIENCE)) == (0, 0)
        listener.until(lambda: not listener.here)

    assert {message.robot for message in listener.alignments} == {FIRST}
    message = listener.alignments[-1]
    assert (message.reference.version, message.other.version) == tuple(
        last[robot].version for robot in "ab"
    )
    assert [(al.reference, al.other) for al in message.alignments] == [("a/0", "b/0")]
    assert not listener.statuses[SECOND].compared
    status = listener.statuses["a"]
    assert (status.scans_seen, status.scans_total) == (SCANS, SCANS)
    assert status.scans_placed == sum(
        len(submap.trajectory.scan_index) for submap in last["a"].submaps
    )


def test_what_a_robot_says_it_sent_is_what_was_sent(
    endpoint: str, team: str, logs: list[Path]
) -> None:
    sizes: list[int] = []
    with open_session([endpoint], patience=PATIENCE) as session:
        key = keys.MAP.build(team=team, robot="a")
        listener = Listener(session, team)

        def weigh(sample: zenoh.Sample) -> None:
            sizes.append(len(sample.payload.to_bytes()))

        with (
            declare_subscriber(session, key, weigh, history=MESSAGES_TO_COMPLETE),
            agent("a", logs[0], team, endpoint),
        ):
            listener.until(lambda: listener.finished("a"))
            sent = listener.statuses["a"].sent["map"]
            listener.until(lambda: len(sizes) == sent.messages)
    assert sum(sizes) == sent.bytes


def test_who_asks_is_told_at_once_how_a_robot_is(
    endpoint: str, team: str, logs: list[Path]
) -> None:
    with open_session([endpoint], patience=PATIENCE) as session:
        listener = Listener(session, team)
        with agent("a", logs[0], team, endpoint):
            listener.until(lambda: listener.finished("a"))
            time.sleep(3 * AGAIN)  # then it has said for some time all that it has to say
            told = mapweave_protocol.statuses(team, connect=[endpoint], timeout=STATUS / 2)
            assert next(told).state == "finished"


def test_when_the_responsible_robot_is_gone_the_other_one_compares(
    endpoint: str, team: str, logs: list[Path]
) -> None:
    """The test plays the responsible robot, which publishes its map, and never compares."""
    theirs = mapped(FIRST, logs[0])
    live = keys.LIVE.build(team=team, robot=FIRST, boot=theirs.boot)
    with (
        open_session([endpoint], patience=PATIENCE) as session,
        open_session([endpoint], patience=PATIENCE) as lazy,
    ):
        listener = Listener(session, team)
        with (
            declare_map_publisher(lazy, keys.MAP.build(team=team, robot=FIRST)) as publisher,
            agent(SECOND, logs[1], team, endpoint),
        ):
            with lazy.liveliness().declare_token(live):
                publisher.put(MapSender().payload(theirs))
                listener.until(lambda: listener.finished(SECOND))
                assert not listener.alignments
            listener.until(lambda: len(listener.alignments) > 0)
    message = listener.alignments[-1]
    assert message.robot == SECOND
    assert (message.reference.robot, message.other.robot) == ("a", "b")


def test_nonsense_from_another_robot_does_not_stop_one(
    endpoint: str, team: str, logs: list[Path]
) -> None:
    with open_session([endpoint], patience=PATIENCE) as session:
        listener = Listener(session, team)
        with agent("a", logs[0], team, endpoint) as process:
            for keys_of in (keys.MAP, keys.STATUS):
                session.put(keys_of.build(team=team, robot="b"), b"\xc1 nonsense")
            session.put(
                keys.ALIGNMENT.build(team=team, robot="b", reference="a", other="b"), b"\x91" * 99
            )
            listener.until(lambda: listener.finished("a"))
            assert process.poll() is None
        assert ask_robot_map(session, team, "a") is None


def test_a_log_that_cannot_be_used_is_named_in_one_line_before_connecting(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    missing = tmp_path / "none.log"
    words = ["agent", "--robot", "a", "--log", str(missing), "--connect", "tcp/127.0.0.1:9"]
    assert main(words) == EXIT_FAILED
    error = capsys.readouterr().err
    assert str(missing) in error
    assert error.count("\n") == 1


def test_a_robot_id_that_is_none_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["agent", "--robot", "Robot 1", "--log", "any.log"]) == EXIT_FAILED
    assert "robot 'Robot 1': expected" in capsys.readouterr().err


@pytest.mark.parametrize(
    "wrong", [["--rate", "0"], ["--scans", "9:3"], ["--map-interval", "-1"], ["--rate", "fast"]]
)
def test_a_wrong_argument_is_wrong_usage(wrong: list[str]) -> None:
    with pytest.raises(SystemExit) as stopped:
        main(["agent", "--robot", "a", "--log", "any.log", *wrong])
    assert stopped.value.code == EXIT_USAGE
