"""What robots leave behind when they end: all that they mapped and found."""

import signal
import time
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path

import pytest

import mapweave_protocol
from mapweave.maps import RobotMap
from mapweave_agent.past_runs import StateFolder
from mapweave_deploy.run.launcher import Plan, start_agent, start_router, start_server
from mapweave_deploy.run.processes import Child, ProcessGroup
from mapweave_deploy.run.team_plan import Member
from tests.deploy.run.test_claimants import joined_names
from tests.deploy.run.test_outages import child, plan_of, says, scans_held, scans_of, until
from tests.deploy.run.test_restarts import member


def kept(plan: Plan, robot: str) -> list[RobotMap]:
    """Return the maps of a robot's runs on disk."""
    return [run.map for run in StateFolder(plan.states / robot).runs(robot, time.time())]


def end(crew: ProcessGroup, ending: Child) -> None:
    """Tell a process to end, and wait until it has."""
    ending.terminate()
    assert ending.process.wait(60) in (0, -signal.SIGTERM)
    crew.children.remove(ending)


def test_a_coordinator_started_after_the_robots_ended_gets_all_when_they_start_again(
    tmp_path: Path,
) -> None:
    r1, r2 = (replace(member(robot), scans=(0, 55)) for robot in ("r1", "r2"))
    plan = plan_of([r1, r2], tmp_path)
    with ProcessGroup(tmp_path) as crew:
        start_router(crew, plan)
        for robot in (r1, r2):
            start_agent(crew, plan, robot)
        until(lambda: any(path.stat().st_size > 100 for path in plan.states.glob("*/*.found")))
        for robot in (r1, r2):
            until(partial(says, tmp_path, f"agent-{robot.robot}", "finished:"))
            end(crew, child(crew, f"agent {robot.robot}"))
        start_server(crew, plan, tmp_path / "empty.sqlite")
        for robot in (r1, r2):  # each sees too little now to be joined to anything
            start_agent(crew, plan, replace(robot, scans=(55, 57)))
        until(lambda: {"r1/0", "r2/0"} <= (joined_with(plan, "r1/0") or set()))
        for robot in (r1, r2):
            [first, _] = kept(plan, robot.robot)
            assert scans_of(first) == 55


def joined_with(plan: Plan, name: str) -> set[str] | None:
    joint = next(mapweave_protocol.joint_maps(plan.team, connect=[plan.listen], timeout=5.0), None)
    components = () if joint is None else joint.components
    return next((set(c.robots) for c in components if name in c.robots), None)


@pytest.fixture
def driving(tmp_path: Path) -> Iterator[tuple[ProcessGroup, Plan, Member]]:
    """Return a team whose robot drives in real time."""
    r1 = member("r1")
    plan = replace(plan_of([r1], tmp_path), rate="4")
    with ProcessGroup(tmp_path) as crew:
        start_router(crew, plan)
        start_server(crew, plan, plan.store)
        start_agent(crew, plan, r1)
        until(lambda: kept(plan, "r1"))
        yield crew, plan, r1


def test_a_robot_told_to_stop_publishes_and_keeps_every_scan_it_has_mapped(
    driving: tuple[ProcessGroup, Plan, Member],
) -> None:
    crew, plan, _ = driving
    end(crew, child(crew, "agent r1"))
    [last] = kept(plan, "r1")
    assert scans_of(last) == last.submaps[-1].trajectory.scan_index[-1] + 1
    assert scans_held(plan, "r1") == scans_of(last) < 70


def test_the_last_map_counts_though_the_farewell_may_overtake_it(
    tmp_path: Path,
) -> None:
    r1, r2 = (replace(member(robot), scans=(0, 55)) for robot in ("r1", "r2"))
    plan = plan_of([r1, r2], tmp_path)
    with ProcessGroup(tmp_path) as crew:
        start_router(crew, plan)
        start_server(crew, plan, plan.store)
        start_agent(crew, plan, r1)
        until(lambda: says(tmp_path, "agent-r1", "finished:"))
        end(crew, child(crew, "agent r1"))  # the moment that it has put its last map
        assert scans_held(plan, "r1") == 55
        start_agent(crew, plan, r2)
        until(lambda: joined_names(plan) == {"r1/0", "r2/0"})
