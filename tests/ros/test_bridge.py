"""A team's processes, and what ROS 2 hears of them."""

import signal
import subprocess
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest

from mapweave.cli import main
from mapweave_protocol.link.session import open_session
from mapweave_ros.messages import MARKER_ARRAY, OCCUPANCY_GRID, TF_MESSAGE
from tests.agent.test_agent import MAPWEAVE, PATIENCE
from tests.ros.listeners import listening
from tests.ros.test_output import CELL, distance_to, occupied, segments_of

SCANS = ":150"


def children(message: Any) -> set[tuple[str, str]]:  # noqa: ANN401
    """Return which frame is in which."""
    return {(t.header.frame_id, t.child_frame_id) for t in message.transforms}


def parents(message: Any) -> set[str]:  # noqa: ANN401
    return {parent for parent, _ in children(message)}


def test_an_agent_and_a_bridge_show_ros_2_the_walls_and_frames_of_a_team(
    endpoint: str, team: str, logs: list[Path], tmp_path: Path
) -> None:
    reached, network = ("--team", team, "--connect", endpoint), "ros2:?domain=31"
    own = ("--robot", "a", "--log", str(logs[0]), "--scans", SCANS, "--rate", "5")
    commands = (
        ("server", *reached, "--store", str(tmp_path / "store.sqlite")),
        ("bridge", *reached, "--to", network),
        ("agent", *reached, *own, "--publish", network),
    )
    with ExitStack() as stack:
        session = stack.enter_context(open_session([endpoint], patience=PATIENCE))
        topics = {"/map": OCCUPANCY_GRID, "/a/map": OCCUPANCY_GRID, "/tf": TF_MESSAGE}
        topics |= {"/walls": MARKER_ARRAY, "/a/walls": MARKER_ARRAY}
        heard = {
            topic: stack.enter_context(listening(session, 31, topic, kind))
            for topic, kind in topics.items()
        }
        processes = [
            stack.enter_context(subprocess.Popen([MAPWEAVE, *command])) for command in commands
        ]
        for process in processes:
            stack.callback(process.kill)
        joined = heard["/tf"].until(lambda message: "map" in parents(message))
        for topic in topics:
            heard[topic].wait(1)
        process_of_agent = processes.pop()
        for process in processes[::-1]:
            process.send_signal(signal.SIGINT)
            assert process.wait(PATIENCE) == 0
        process_of_agent.send_signal(signal.SIGINT)
        assert process_of_agent.wait(PATIENCE) == 0
    assert children(joined) == {("a/map", "a/sensor"), ("map", "a/map")}
    for topic, frame in (("", "map"), ("/a", "a/map")):
        grid, shown = heard[f"{topic}/map"].messages[-1], heard[f"{topic}/walls"].messages[-1]
        assert grid.header.frame_id == frame
        assert distance_to(occupied(grid), segments_of(shown, "walls")).max() <= CELL


def test_a_place_to_show_a_team_that_is_none_is_refused_with_those_there_are(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["bridge", "--to", "foxglove"]) == 1
    said = capsys.readouterr().err
    assert said.endswith("expected ros2:, or foxglove:PORT such as foxglove:8765, got 'foxglove'\n")


def test_a_bridge_to_a_team_that_is_not_there_says_what_it_waits_for(
    endpoint: str, team: str
) -> None:
    reached = ("--team", team, "--connect", endpoint)
    with subprocess.Popen(
        [MAPWEAVE, "bridge", *reached, "--to", "ros2:?domain=31"],
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        assert process.stderr is not None
        said = next(line for line in process.stderr if "nothing yet" in line)
        process.terminate()
        process.wait(PATIENCE)
    assert f"nothing yet of team {team}: waits for a joint map, which mapweave server" in said
