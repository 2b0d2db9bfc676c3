"""An agent that a program feeds, and one that lines on standard input do, around a real router."""

import json
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from queue import SimpleQueue
from unittest.mock import Mock

import numpy as np
import pytest

import mapweave_agent
from mapweave.errors import ArgumentError, FileError, InvalidIdError, MapweaveError
from mapweave.io.map_files import read_map
from mapweave.io.readers import read_scans
from mapweave.mapping.mapper import Mapper
from mapweave.maps import RobotMap
from mapweave.scan.scan import Scan
from mapweave_agent.agent import AgentRun
from mapweave_agent.past_runs import StateFolder, default_folder
from mapweave_agent.publication_schedule import AgentParameters, PublicationSchedule
from mapweave_protocol.errors import UnreachableError
from mapweave_protocol.link.session import open_session
from mapweave_protocol.wire.coding.trajectory_code import PER_METRE
from mapweave_protocol.wire.messages import AlignmentMessage, PoseMessage
from tests.agent.test_agent import MAPWEAVE, PATIENCE, SCANS, Listener

HALF_A_STEP = 0.501 / PER_METRE  # [m] of the poses of scans on the wire


def scans_of(log: Path) -> list[Scan]:
    return list(read_scans(log))[:SCANS]


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def until(condition: Callable[[], bool]) -> None:
    deadline = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.05)


def as_line(scan: Scan) -> str:
    return json.dumps(
        {
            "stamp": scan.stamp,
            "angle_min": float(scan.angles[0]),
            "angle_increment": float(scan.angles[1] - scan.angles[0]),
            "ranges": scan.ranges.tolist(),
        }
    )


def assert_mapped(robot_map: RobotMap, scans: list[Scan]) -> None:
    """Assert that the map is that of all `scans`, as they would be mapped at rest."""
    mapper = Mapper(robot_map.robot)
    for scan in scans:
        mapper.add(scan)
    expected = mapper.finish()
    assert len(robot_map.submaps) == len(expected.submaps) > 0
    for submap, other in zip(robot_map.submaps, expected.submaps, strict=True):
        paths = submap.trajectory, other.trajectory
        np.testing.assert_array_equal(paths[0].scan_index, paths[1].scan_index)
        np.testing.assert_allclose(paths[0].pose, paths[1].pose, atol=HALF_A_STEP)


def test_lines_on_standard_input_are_mapped_as_their_log_is(
    endpoint: str, team: str, logs: list[Path]
) -> None:
    scans = scans_of(logs[0])
    where = ["--robot", "a", "--team", team, "--connect", endpoint, "--source", "-"]
    where += ["--rate", "max"]
    with open_session([endpoint], patience=PATIENCE) as session:
        listener = Listener(session, team)
        with subprocess.Popen(
            [MAPWEAVE, "agent", *where], stdin=subprocess.PIPE, text=True
        ) as process:
            assert process.stdin is not None
            process.stdin.write("".join(f"{as_line(scan)}\n" for scan in scans))
            process.stdin.close()
            listener.until(lambda: listener.finished("a"))
            process.terminate()
            assert process.wait(PATIENCE) == 0
    assert_mapped(listener.maps["a"], scans)
    assert listener.statuses["a"].scans_seen == SCANS


def test_an_agent_that_is_interrupted_leaves_its_map_to_go_on_from(
    endpoint: str, team: str, logs: list[Path], tmp_path: Path
) -> None:
    scans, file = scans_of(logs[0])[:60], tmp_path / "r1.json"
    where = ["--robot", "a", "--team", team, "--connect", endpoint, "--source", "-"]
    where += ["--rate", "max", "--output", str(file)]
    with open_session([endpoint], patience=PATIENCE) as session:
        listener = Listener(session, team)
        with subprocess.Popen(
            [MAPWEAVE, "agent", *where], stdin=subprocess.PIPE, text=True
        ) as process:
            assert process.stdin is not None
            process.stdin.write("".join(f"{as_line(scan)}\n" for scan in scans))
            process.stdin.flush()
            listener.until(
                lambda: "a" in listener.statuses and listener.statuses["a"].scans_seen >= 40
            )
            process.send_signal(signal.SIGINT)
            assert process.wait(PATIENCE) == 0
    left = read_map(file)
    assert left.robot == "a"
    assert sum(len(submap.trajectory.scan_index) for submap in left.submaps) >= 40
    mapper = Mapper("a", known=left)
    for scan in scans:
        mapper.add(scan)
    assert mapper.finish().components == [0]


def test_a_robot_that_drives_before_there_is_a_router_maps_and_is_in_its_team_once_there_is(
    team: str, logs: list[Path]
) -> None:
    scans, later = scans_of(logs[0]), f"tcp/127.0.0.1:{free_port()}"
    where = ["--robot", "a", "--team", team, "--connect", later, "--source", "-", "--rate", "max"]
    with subprocess.Popen([MAPWEAVE, "agent", *where], stdin=subprocess.PIPE, text=True) as process:
        assert process.stdin is not None
        process.stdin.write("".join(f"{as_line(scan)}\n" for scan in scans))
        process.stdin.close()
        state = StateFolder(default_folder(team, "a"))
        until(lambda: any(last_scan(run.map) == SCANS - 1 for run in state.runs("a", time.time())))
        with (
            subprocess.Popen([MAPWEAVE, "router", "--listen", later]) as router,
            open_session([later], patience=PATIENCE) as session,
        ):
            listener = Listener(session, team)
            listener.until(lambda: listener.finished("a"))
            process.terminate()
            assert process.wait(PATIENCE) == 0
            router.terminate()
    assert_mapped(listener.maps["a"], scans)
    assert listener.statuses["a"].scans_seen == SCANS


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGTERM])
def test_a_robot_whose_router_never_comes_leaves_its_map_when_its_group_is_told_twice_to_end(
    team: str, logs: list[Path], tmp_path: Path, how: signal.Signals
) -> None:
    file = tmp_path / "r1.json"
    where = ["--robot", "a", "--team", team, "--connect", "tcp/127.0.0.1:1", "--source", "-"]
    where += ["--rate", "max", "--output", str(file)]
    with subprocess.Popen(
        [MAPWEAVE, "agent", *where],
        stdin=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    ) as process:
        assert process.stdin is not None
        process.stdin.write("".join(f"{as_line(scan)}\n" for scan in scans_of(logs[0])))
        process.stdin.flush()
        state = StateFolder(default_folder(team, "a"))
        until(lambda: bool(state.runs("a", time.time())))
        for _ in range(2):  # as `timeout` does: the process, and then its group
            os.killpg(process.pid, how)
            time.sleep(0.05)
        _, said = process.communicate(timeout=PATIENCE)
    assert process.returncode == 0
    assert "ERROR" not in said and "Traceback" not in said
    assert read_map(file).submaps


def test_what_came_before_a_source_failed_is_in_the_map_that_an_agent_leaves(
    team: str, logs: list[Path], tmp_path: Path
) -> None:
    file, scans = tmp_path / "r1.json", scans_of(logs[0])
    where = ["--robot", "a", "--team", team, "--connect", "tcp/127.0.0.1:1", "--source", "-"]
    lines = [*map(as_line, scans), '{"format": "mapweave/scans/2"}']
    done = subprocess.run(
        [MAPWEAVE, "agent", *where, "--rate", "max", "--output", file],
        input="\n".join(lines),
        capture_output=True,
        text=True,
        check=False,
        timeout=PATIENCE,
    )
    assert done.returncode == 1
    assert f"standard input: line {SCANS + 1} is of format" in done.stderr.splitlines()[-1]
    assert last_scan(read_map(file)) == SCANS - 1


def test_what_is_wrong_with_standard_input_ends_the_agent_in_one_line(
    endpoint: str, team: str
) -> None:
    where = ["--robot", "a", "--team", team, "--connect", endpoint, "--source", "-"]
    done = subprocess.run(
        [MAPWEAVE, "agent", *where],
        input='{"format": "mapweave/map/1"}\n',
        capture_output=True,
        text=True,
        check=False,
        timeout=PATIENCE,
    )
    assert done.returncode == 1
    assert done.stderr.splitlines()[-1].startswith("mapweave: standard input: line 1 is of format")
    assert "Traceback" not in done.stderr


def test_a_program_feeds_an_agent_and_its_map_is_complete_when_the_block_ends(
    endpoint: str, team: str, logs: list[Path]
) -> None:
    scans = scans_of(logs[0])
    with open_session([endpoint], patience=PATIENCE) as session:
        listener = Listener(session, team)
        with mapweave_agent.Agent("a", team, connect=endpoint, patience=PATIENCE) as agent:
            for scan in scans:
                while agent.waiting:
                    time.sleep(0.01)
                agent.feed(scan.ranges, scan.angles[0], scan.angles[1] - scan.angles[0], scan.stamp)
        listener.until(lambda: listener.finished("a"))
    assert agent.skipped == 0
    assert_mapped(listener.maps["a"], scans)
    assert_mapped(agent.robot_map, scans)


def test_a_program_is_told_where_its_robot_is_at_the_rate_of_its_scans(
    endpoint: str, team: str, logs: list[Path]
) -> None:
    scans, told, all_told = scans_of(logs[0]), list[PoseMessage](), threading.Event()
    awaited = []

    def tell(pose: PoseMessage) -> None:
        told.append(pose)
        if pose.scan_index == len(scans) - 1:
            all_told.set()

    with mapweave_agent.Agent(
        "a", team, connect=endpoint, patience=PATIENCE, on_pose=tell
    ) as agent:
        for index, scan in enumerate(scans):
            awaited += [index] * bool(told)  # who subscribes is late: the first ones may be lost
            agent.feed(scan.ranges, scan.angles[0], scan.angles[1] - scan.angles[0], scan.stamp)
            while agent.waiting or (index in awaited and told[-1].scan_index < index):
                time.sleep(0.005)
        assert all_told.wait(PATIENCE)
    mapper, heard = Mapper("a"), {pose.scan_index: pose for pose in told}
    assert set(awaited) <= set(heard)
    assert len(awaited) > len(scans) / 2
    for index, scan in enumerate(scans):
        placement = mapper.add(scan)
        if index in heard and placement.pose is not None:
            assert (heard[index].found, heard[index].component) == (True, "a/0")
            np.testing.assert_allclose(np.array(heard[index].pose), placement.pose, atol=6e-5)


def test_scans_are_mapped_while_the_agent_is_held_up_with_everything_else(
    endpoint: str, team: str, logs: list[Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    held_up, told = threading.Event(), list[int]()
    attend = AgentRun._attend

    def held(run: AgentRun, wait: float) -> None:
        held_up.wait(PATIENCE)
        attend(run, wait)

    monkeypatch.setattr(AgentRun, "_attend", held)
    with mapweave_agent.Agent(
        "a", team, connect=endpoint, patience=PATIENCE, on_pose=lambda p: told.append(p.scan_index)
    ) as agent:
        for scan in scans_of(logs[0]):
            agent.feed(scan.ranges, scan.angles[0], scan.angles[1] - scan.angles[0], scan.stamp)
            while agent.waiting:
                time.sleep(0.005)
        deadline = time.monotonic() + PATIENCE
        while SCANS - 1 not in told and time.monotonic() < deadline:
            time.sleep(0.01)
        held_up.set()
    assert told[-1] == SCANS - 1
    assert agent.skipped == 0


def test_what_holds_a_mark_is_told_at_once_however_little_was_driven(
    endpoint: str, team: str, logs: list[Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(PublicationSchedule, "due", lambda plan, _: plan._urgent)
    told = list[int]()
    with open_session([endpoint], patience=PATIENCE) as session:
        listener = Listener(session, team)
        with mapweave_agent.Agent(
            "a",
            team,
            connect=endpoint,
            patience=PATIENCE,
            on_pose=lambda p: told.append(p.scan_index),
        ) as agent:
            for scan in scans_of(logs[0]):
                agent.feed(scan.ranges, scan.angles[0], scan.angles[1] - scan.angles[0], scan.stamp)
                while agent.waiting:
                    time.sleep(0.005)
            listener.until(lambda: SCANS - 1 in told)
            agent.mark("victim", 1.0, 0.0, frame="sensor")
            listener.until(
                lambda: "a" in listener.maps and last_scan(listener.maps["a"]) == SCANS - 1
            )
            assert not listener.finished("a")


def last_scan(robot_map: RobotMap) -> int:
    return int(robot_map.submaps[-1].trajectory.scan_index[-1])


def test_what_fails_beside_the_mapping_ends_the_agent(
    endpoint: str, team: str, logs: list[Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(_: AgentRun) -> None:
        raise FileError("state", "is full")

    monkeypatch.setattr(AgentRun, "_publish_map", fail)

    def feed_all() -> None:
        with mapweave_agent.Agent("a", team, connect=endpoint, patience=PATIENCE) as agent:
            for scan in scans_of(logs[0]):
                agent.feed(scan.ranges, scan.angles[0], scan.angles[1] - scan.angles[0])
                time.sleep(0.05)

    with pytest.raises(FileError, match="state: is full"):
        feed_all()


def test_what_is_no_scan_is_refused_where_it_is_fed(endpoint: str, team: str) -> None:
    with mapweave_agent.Agent("a", team, connect=endpoint, patience=PATIENCE) as agent:
        with pytest.raises(ArgumentError, match="angle_increment"):
            agent.feed([1.0] * 10, 0.0, 0.0)
        with pytest.raises(ArgumentError, match="ranges: expected 10 beams or more, got 9"):
            agent.feed([1.0] * 9, 0.0, 0.1)


def test_an_agent_is_used_within_its_block_only(endpoint: str, team: str) -> None:
    agent = mapweave_agent.Agent("a", team, connect=endpoint, patience=PATIENCE)
    for use in (partial(agent.feed, [1.0] * 10, 0.0, 0.1), partial(agent.mark, "victim", 0.0, 0.0)):
        with pytest.raises(MapweaveError, match="within its block"):
            use()
    with agent:
        agent.feed([1.0] * 10, 0.0, 0.1)
    with pytest.raises(MapweaveError, match="within its block"):
        agent.feed([1.0] * 10, 0.0, 0.1)


def test_a_program_is_told_how_its_team_s_maps_lie_in_each_other(
    endpoint: str, team: str, logs: list[Path]
) -> None:
    told = SimpleQueue[AlignmentMessage]()
    with (
        mapweave_agent.Agent(
            "a", team, connect=endpoint, patience=PATIENCE, on_alignment=told.put
        ) as a,
        mapweave_agent.Agent("b", team, connect=endpoint, patience=PATIENCE) as b,
    ):
        for agent, log in zip((a, b), logs, strict=False):
            for scan in scans_of(log):
                agent.feed(scan.ranges, scan.angles[0], scan.angles[1] - scan.angles[0], scan.stamp)
                while agent.waiting:
                    time.sleep(0.002)
        heard = told.get(timeout=PATIENCE)
    assert {heard.reference.robot, heard.other.robot} == {"a", "b"}


def test_a_block_that_fails_ends_the_agent_at_once(endpoint: str, team: str) -> None:
    with (
        pytest.raises(RuntimeError, match="lidar unplugged"),
        mapweave_agent.Agent("a", team, connect=endpoint, patience=PATIENCE),
    ):
        raise RuntimeError("lidar unplugged")


def test_without_a_router_the_block_does_not_begin(team: str) -> None:
    agent = mapweave_agent.Agent("a", team, connect="tcp/127.0.0.1:1", patience=0.5)
    with pytest.raises(UnreachableError), agent:
        pytest.fail("began")


def test_an_id_that_is_none_is_refused_at_once() -> None:
    with pytest.raises(InvalidIdError, match="robot 'R 1'"):
        mapweave_agent.Agent("R 1")


def test_importing_the_package_loads_no_solver() -> None:
    code = "import mapweave_agent, sys; sys.exit('gtsam' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_a_stored_map_that_a_run_goes_on_from_is_numbered_as_the_run_is_from_the_beginning(
    tmp_path: Path, logs: list[Path]
) -> None:
    first = Mapper("a")
    for scan in scans_of(logs[0])[:10]:
        first.add(scan)
    mapper, state = Mapper("a", known=first.finish()), StateFolder(tmp_path)
    run = AgentRun(Mock(), "t", mapper, Mock(), None, AgentParameters(), state, first=3)
    assert run.robot_map.components == [3]


def test_scans_of_a_stored_map_are_not_counted_as_placed_by_the_run_that_goes_on(
    endpoint: str, team: str, logs: list[Path]
) -> None:
    scans, mapper = scans_of(logs[0]), Mapper("a")
    for scan in scans[:20]:
        mapper.add(scan)
    with open_session([endpoint], patience=PATIENCE) as session:
        listener = Listener(session, team)
        with mapweave_agent.Agent(
            "a", team, connect=endpoint, patience=PATIENCE, continued=mapper.finish()
        ) as agent:
            for scan in scans[20:]:
                while agent.waiting:
                    time.sleep(0.01)
                agent.feed(scan.ranges, scan.angles[0], scan.angles[1] - scan.angles[0], scan.stamp)
        listener.until(lambda: listener.finished("a"))
    status = listener.statuses["a"]
    new = len(scans) - 20
    assert (status.scans_seen, status.scans_placed) == (new, new)
