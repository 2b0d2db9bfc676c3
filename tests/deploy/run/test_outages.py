"""What real processes lose when the link between them breaks: nothing."""

import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import mapweave_protocol
from mapweave.maps import RobotMap
from mapweave_deploy.run.launcher import (
    Plan,
    free_endpoint,
    start_agent,
    start_router,
    start_server,
)
from mapweave_deploy.run.processes import Child, ProcessGroup
from mapweave_deploy.run.team_plan import Member
from mapweave_deploy.sim.simulation import simulate
from mapweave_protocol.link.asking import ask_robot_map
from mapweave_protocol.link.assembler import MapAssembler
from mapweave_protocol.link.session import open_session

SCANS = 60  # a few seconds of mapping
PATIENCE = 90.0  # [s] for a machine with much else to do


def until(condition: Callable[[], object]) -> None:
    """Wait for a condition; fail when it does not come about."""
    deadline = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.05)


def says(folder: Path, process: str, words: str) -> bool:
    """Tell whether a process of the team has said some words."""
    log = folder / f"{process}.log"
    return log.exists() and words in log.read_text()


def plan_of(members: list[Member], folder: Path, keys: Path | None = None) -> Plan:
    """Return a plan whose processes keep everything in `folder`."""
    listen, store = free_endpoint(encrypted=keys is not None), folder / "store.sqlite"
    return Plan("t", members, "max", listen, store, folder / "states", None, keys=keys)


@pytest.fixture
def plan(tmp_path: Path, keys: Path | None) -> Plan:
    """Return a team of one robot, with a short log."""
    [robot] = simulate("arena", 1, 1, tmp_path / "logs")
    nothing = np.empty(0, dtype=np.int64)
    member = Member("r1", robot.log, (0, SCANS), "arena", nothing, np.empty((0, 3)))
    return plan_of([member], tmp_path, keys)


def end(crew: ProcessGroup, child: Child) -> None:
    """Kill a process of the team, which then is none of it any more."""
    child.kill()
    crew.children.remove(child)


def child(crew: ProcessGroup, name: str) -> Child:
    """Return the process of that name."""
    return next(each for each in crew.children if each.name == name)


def scans_held(plan: Plan, robot: str) -> int:
    """Return how many scans of a robot the coordinator holds."""
    with open_session([plan.listen], patience=PATIENCE) as session:
        message = ask_robot_map(session, plan.team, robot)
    held = MapAssembler().update(message) if message else None
    return scans_of(held) if held else 0


def scans_of(robot_map: RobotMap) -> int:
    return sum(len(submap.trajectory.scan_index) for submap in robot_map.submaps)


def test_the_last_map_of_a_parked_robot_arrives_after_the_outage_it_was_published_in(
    tmp_path: Path, plan: Plan
) -> None:
    with ProcessGroup(tmp_path) as crew:
        start_router(crew, plan)
        start_server(crew, plan, plan.store)
        start_agent(crew, plan, plan.members[0])
        until(lambda: says(tmp_path, "server", "r1: 1 submap"))
        end(crew, child(crew, "router"))
        until(lambda: says(tmp_path, "agent-r1", "finished: 60 of 60 scans placed"))
        start_router(crew, plan)
        until(lambda: scans_held(plan, "r1") == SCANS)


def test_a_coordinator_that_lost_everything_gets_it_back_from_robots_that_have_finished(
    tmp_path: Path, plan: Plan
) -> None:
    with ProcessGroup(tmp_path) as crew:
        start_router(crew, plan)
        start_server(crew, plan, plan.store)
        start_agent(crew, plan, plan.members[0])
        until(lambda: says(tmp_path, "agent-r1", "finished: 60 of 60 scans placed"))
        end(crew, child(crew, "server"))
        start_server(crew, plan, tmp_path / "empty.sqlite")
        until(lambda: scans_held(plan, "r1") == SCANS)
        joint = next(mapweave_protocol.joint_maps(plan.team, connect=[plan.listen]))
    assert [sorted(component.robots) for component in joint.components] == [["r1/0"]]
