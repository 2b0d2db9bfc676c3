"""Units and containers start commands that exist, as nobody in particular, and are looked after."""

import argparse
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import threading
import time
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any

import pytest
from ruamel.yaml import YAML

from mapweave.cli import COMMAND_GROUP, Command
from mapweave_protocol.link.service_manager import ServiceManager

ROOT = Path(__file__).parents[3]
UNITS = sorted((ROOT / "deploy" / "systemd").glob("*.service"))
CONTAINER = ROOT / "deploy" / "container"
MAPWEAVE = Path(sys.executable).with_name("mapweave")
PROGRAM = "/opt/mapweave/bin/mapweave"
EXPOSED = 2.0  # of 10, as systemd-analyze counts; services without any hardening have 9.6
PATIENCE = 30.0  # [s]


def _parse(words: list[str]) -> argparse.Namespace:
    """Return what a command makes of its arguments; SystemExit if it does not take them."""
    [point] = [point for point in entry_points(group=COMMAND_GROUP) if point.name == words[0]]
    command: Command = point.load()
    parser = argparse.ArgumentParser()
    command.configure(parser)
    return parser.parse_args(words[1:])


def _compose() -> dict[str, Any]:
    content: dict[str, Any] = YAML(typ="safe").load(CONTAINER / "compose.yaml")
    return content


@pytest.mark.parametrize("unit", UNITS, ids=lambda unit: unit.name)
def test_a_unit_starts_a_command_that_takes_its_arguments(unit: Path) -> None:
    [line] = re.findall(r"^ExecStart=(.*)$", unit.read_text(), re.MULTILINE)
    program, *words = line.split()
    assert program == PROGRAM
    values = {"${MAPWEAVE_TEAM}": "team", "%i": "r1", "${MAPWEAVE_SOURCE}": "ros2:/scan"}
    options = _parse([values.get(word, word) for word in words])
    assert options.tls == Path("${CREDENTIALS_DIRECTORY}")


@pytest.mark.parametrize("unit", UNITS, ids=lambda unit: unit.name)
@pytest.mark.skipif(shutil.which("systemd-analyze") is None, reason="no systemd here")
def test_systemd_finds_nothing_wrong_with_a_unit_and_it_may_do_little(
    unit: Path, tmp_path: Path
) -> None:
    copy = tmp_path / unit.name
    copy.write_text(unit.read_text().replace(PROGRAM, "/bin/true"))
    verified = _systemd("verify", "--man=no", copy)
    assert (verified.returncode, verified.stderr) == (0, "")
    security = _systemd("security", "--offline=yes", copy)
    [exposure] = re.findall(r"exposure level for .*: ([0-9.]+)", security.stdout)
    assert float(exposure) <= EXPOSED


def _systemd(*words: str | Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        ["systemd-analyze", *words],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "SYSTEMD_COLORS": "0", "SYSTEMD_PAGER": "cat"},
    )


def test_there_is_a_unit_for_each_part() -> None:
    assert [unit.name for unit in UNITS] == [
        "mapweave-agent@.service",
        "mapweave-router.service",
        "mapweave-server.service",
    ]
    for unit in UNITS:
        text = unit.read_text()
        for setting in ("Type=notify", "WatchdogSec=", "DynamicUser=yes", "MemoryMax="):
            assert f"\n{setting}" in text


@pytest.mark.parametrize(
    "change", [("", ""), ("mem_limit", "mem_limt"), ("retries: 3", "retries: [3]")]
)
def test_the_compose_file_is_what_the_compose_schema_allows(
    change: tuple[str, str], tmp_path: Path
) -> None:
    before, after = change
    copy = tmp_path / "compose.yaml"
    copy.write_text(
        (CONTAINER / "compose.yaml").read_text().replace(before, after, 1 if before else 0)
    )
    checked = subprocess.run(
        [MAPWEAVE.with_name("check-jsonschema"), "--builtin-schema", "vendor.compose-spec", copy],
        capture_output=True,
        text=True,
        check=False,
    )
    assert (checked.returncode == 0) == (before == after), checked.stdout + checked.stderr


def test_the_containers_start_commands_that_take_their_arguments() -> None:
    services = _compose()["services"]
    assert set(services) == {"router", "coordinator", "r1"}
    commands = {name: _parse(service["command"]) for name, service in services.items()}
    assert commands["r1"].robot == "r1"
    assert commands["coordinator"].http is not None


def test_the_containers_have_few_rights_and_are_asked_how_they_are() -> None:
    for service in _compose()["services"].values():
        assert service["read_only"] is True
        assert service["cap_drop"] == ["ALL"]
        assert service["security_opt"] == ["no-new-privileges:true"]
        assert service["healthcheck"]["test"][0] == "CMD"
        assert service["mem_limit"]
        keys = [volume for volume in service["volumes"] if ":/keys" in volume]
        assert [volume.endswith(":ro") for volume in keys] == [True]
        assert service["environment"]["MAPWEAVE_TLS"] == "/keys"


def test_the_image_is_of_the_wheel_and_does_not_run_as_root() -> None:
    lines = (CONTAINER / "Dockerfile").read_text().splitlines()
    last = max(n for n, line in enumerate(lines) if line.startswith("FROM"))
    assert [line for line in lines[last:] if line.startswith("USER")] == ["USER mapweave"]
    assert any("mapweave-*.whl" in line for line in lines[:last])
    # One Python in both stages, and it can be said: a wheel is of the one that made it.
    assert {line.split()[1] for line in lines if line.startswith("FROM")} == {
        "python:${PYTHON}-slim-bookworm"
    }
    assert lines.index("ARG PYTHON=3.11") < lines.index("FROM python:${PYTHON}-slim-bookworm")
    assert _compose()["services"]["router"]["build"]["args"] == {"PYTHON": "${PYTHON:-3.11}"}
    assert 'ENTRYPOINT ["mapweave"]' in lines


def test_a_service_says_that_it_is_ready_alive_and_stopping(tmp_path: Path) -> None:
    address = tmp_path / "notify"
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as manager:
        manager.bind(str(address))
        manager.settimeout(PATIENCE)
        with socket.create_server(("127.0.0.1", 0)) as probe:
            port = probe.getsockname()[1]
        process = subprocess.Popen(
            [MAPWEAVE, "router", "--listen", f"tcp/127.0.0.1:{port}"],
            env={**os.environ, "NOTIFY_SOCKET": str(address), "WATCHDOG_USEC": "200000"},
            stderr=subprocess.DEVNULL,
        )
        try:
            said = [manager.recv(100) for _ in range(4)]
            process.send_signal(signal.SIGTERM)
            while said[-1] != b"STOPPING=1":
                said.append(manager.recv(100))
            assert process.wait(PATIENCE) == 0
        finally:
            process.kill()
            process.wait()
    assert said[:4] == [b"READY=1", *[b"WATCHDOG=1"] * 3]


def test_without_a_manager_nothing_is_said_and_nothing_fails() -> None:
    environments: list[dict[str, str]] = [
        {},
        {"NOTIFY_SOCKET": "/nowhere/at/all", "WATCHDOG_USEC": "soon"},
    ]
    for environment in environments:
        manager = ServiceManager(environment)
        manager.alive()
        manager.stopping()


def test_a_manager_that_is_slow_to_read_hears_all_the_same_that_a_service_stops(
    tmp_path: Path,
) -> None:
    address = tmp_path / "notify"
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as manager:
        manager.bind(str(address))
        manager.settimeout(PATIENCE)
        service = ServiceManager({"NOTIFY_SOCKET": str(address), "WATCHDOG_USEC": "0"})
        for _ in range(100):  # more than the kernel keeps
            service.alive()
        stopping = threading.Thread(target=service.stopping)
        stopping.start()
        time.sleep(0.1)
        while manager.recv(100) != b"STOPPING=1":
            pass
        stopping.join()
