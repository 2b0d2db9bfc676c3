"""The examples run as they are printed, each as a process of its own."""

import re
import secrets
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest

import mapweave
from mapweave_deploy.sim import simulate

EXAMPLES = Path(__file__).parents[2] / "examples"
MAPWEAVE = Path(sys.executable).with_name("mapweave")
PATIENCE = 60.0  # [s] for what takes a few on a quiet machine
SCANS = 150  # of a log: more than a submap


def run(name: str, *arguments: str | Path, folder: Path) -> str:
    """Return what an example says."""
    done = subprocess.run(
        [sys.executable, EXAMPLES / name, *arguments],
        cwd=folder,
        timeout=2 * PATIENCE,
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, "")
    return done.stdout


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("compare_two_maps.py", "A.json B.json"),
        ("map_a_log.py", "LOG MAP.json ROBOT"),
        ("own_driver.py", "ROBOT TEAM [ENDPOINT]"),
        ("subscribe.py", "TEAM [ENDPOINT]"),
    ],
)
def test_an_example_without_arguments_says_which_it_takes(name: str, words: str) -> None:
    done = subprocess.run(
        [sys.executable, EXAMPLES / name], capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stderr) == (1, f"usage: python {name} {words}\n")
    assert f"python {name} {words}``" in (EXAMPLES / name).read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Return two overlapping stretches of the log of a robot in the arena."""
    folder = tmp_path_factory.mktemp("logs")
    log = simulate("arena", robots=1, seed=1, folder=folder)[0].log
    lines = log.read_text().splitlines(keepends=True)
    stretches = [lines[:SCANS], lines[SCANS // 4 : SCANS // 4 + SCANS]]
    paths = [folder / name for name in ("a.log", "b.log")]
    for path, stretch in zip(paths, stretches, strict=True):
        path.write_text("".join(stretch))
    return paths


def test_the_quickstart_makes_one_map_of_two_robots_in_twelve_lines(tmp_path: Path) -> None:
    source = (EXAMPLES / "quickstart.py").read_text(encoding="utf-8")
    code = source.rpartition('"""')[2]
    assert len([line for line in code.splitlines() if line]) == 12
    run("quickstart.py", folder=tmp_path)
    joint = mapweave.load(tmp_path / "joint.json")
    assert isinstance(joint, mapweave.JointMap)
    assert [sorted(component.robots) for component in joint.components] == [["r1/0", "r2/0"]]
    assert (tmp_path / "joint.png").read_bytes().startswith(b"\x89PNG")


def test_logs_are_mapped_scan_by_scan_and_their_maps_compared(
    logs: list[Path], tmp_path: Path
) -> None:
    for robot, log in zip("ab", logs, strict=True):
        said = run("map_a_log.py", log, f"{robot}.json", robot, folder=tmp_path)
        finished, *_, last = said.splitlines()
        assert re.fullmatch(r"scan \d+: a submap is finished, \d+ segments in all", finished)
        assert re.fullmatch(r"component 0: \d+ segments", last)
        robot_map = mapweave.load(tmp_path / f"{robot}.json")
        assert isinstance(robot_map, mapweave.RobotMap)
        assert robot_map.robot == robot
    said = run("compare_two_maps.py", "a.json", "b.json", folder=tmp_path)
    assert said.startswith("a/0 - b/0: accepted\n")
    assert re.search(r"b/0 lies at .* in a/0, with a confidence of (0\.9\d\d|1\.000)\n", said)


@contextmanager
def running(folder: Path, *command: str | Path) -> Iterator["subprocess.Popen[str]"]:
    """Run a process for the length of a block; what it complains of goes to a file."""
    with (folder / f"{secrets.token_hex(4)}.log").open("w") as complaints:
        process = subprocess.Popen(
            command, cwd=folder, stdout=subprocess.PIPE, stderr=complaints, text=True
        )
        with process:
            try:
                yield process
                process.send_signal(signal.SIGINT)
                process.wait(PATIENCE)
            finally:
                process.kill()  # before its end is waited for


def test_a_subscriber_is_told_each_version_of_the_joint_map(
    logs: list[Path], tmp_path: Path
) -> None:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        endpoint = f"tcp/127.0.0.1:{probe.getsockname()[1]}"
    reached = ("--team", "t", "--connect", endpoint)
    agent = ("agent", *reached, "--robot", "a", "--log", logs[0], "--rate", "max")
    with ExitStack() as processes:
        for command in (("router", "--listen", endpoint), ("server", *reached), agent):
            processes.enter_context(running(tmp_path, MAPWEAVE, *command))
        subscriber = processes.enter_context(
            running(tmp_path, sys.executable, EXAMPLES / "subscribe.py", "t", endpoint)
        )
        assert subscriber.stdout is not None
        told = subscriber.stdout.readline()
    assert re.fullmatch(r"version \d+: a/0: \d+ segments, confidence \d\.\d\d\n", told)
    assert subscriber.returncode == 0


def test_a_driver_of_ones_own_is_a_robot_of_its_team(tmp_path: Path) -> None:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        endpoint = f"tcp/127.0.0.1:{probe.getsockname()[1]}"
    with ExitStack() as processes:
        reached = ("--team", "t", "--connect", endpoint)
        for command in (("router", "--listen", endpoint), ("server", *reached)):
            processes.enter_context(running(tmp_path, MAPWEAVE, *command))
        *versions, last = run("own_driver.py", "r1", "t", endpoint, folder=tmp_path).splitlines()
    assert versions
    assert all(re.fullmatch(r"version \d+: \{'r1/0': [1-9]\d*\}", line) for line in versions)
    assert re.fullmatch(r"mapped, \d+ scans skipped", last)
