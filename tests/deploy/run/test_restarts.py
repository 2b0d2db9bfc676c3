"""A robot that is killed and started again goes on as another run; nothing is lost or mixed."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import mapweave_protocol
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.maps import LineMap, RobotMap, Submap, Trajectory
from mapweave_agent.past_runs import StateFolder
from mapweave_deploy.run.evaluation import component_path
from mapweave_deploy.run.launcher import Plan, start_agent, start_router, start_server
from mapweave_deploy.run.processes import ProcessGroup
from mapweave_deploy.run.team_plan import Member
from mapweave_fusion_server.store import Store
from mapweave_protocol.link.assembler import MapAssembler
from mapweave_protocol.wire.codec import decode
from mapweave_protocol.wire.messages import MapMessage
from tests.deploy.run.test_outages import child, end, plan_of, says, until

CASE = Path(__file__).parents[2] / "cases" / "restart_same_id"  # two robots in the same rooms

COMMON = 45  # a scan of both runs


def member(robot: str) -> Member:
    nothing = np.empty(0, dtype=np.int64)
    return Member(robot, CASE / f"{robot}.log.gz", (0, 70), "rooms", nothing, np.empty((0, 3)))


@pytest.mark.slow
def test_what_a_killed_robot_has_mapped_stays_joined_and_its_next_run_is_joined_to_it(
    tmp_path: Path,
) -> None:
    r1, r2 = member("r1"), member("r2")
    plan = plan_of([r1, r2], tmp_path)
    with ProcessGroup(tmp_path) as crew:
        start_router(crew, plan)
        start_server(crew, plan, plan.store)
        start_agent(crew, plan, r1)
        start_agent(crew, plan, r2)
        until(lambda: says(tmp_path, "agent-r1", "finished:"))
        until(lambda: says(tmp_path, "server", ": r1/0 + r2/0"))
        end(crew, child(crew, "agent r1"))
        start_agent(crew, plan, replace(r1, scans=(40, 70)))
        until(lambda: says(tmp_path, "server", ": r1/0 + r1/1 + r2/0"))
        joint = next(mapweave_protocol.joint_maps(plan.team, connect=[plan.listen]))
    [component] = joint.components
    found = se2.between(component.robots["r1/0"], component.robots["r1/1"])
    np.testing.assert_allclose(found, true_place(plan.store, plan.team), atol=0.1)


def true_place(store: Path, team: str) -> FloatArray:
    """Return the (3,) pose of the second run of r1 in the first one's frame, by a common scan."""
    with Store(store, team) as opened:
        messages = [decode(MapMessage, payload) for payload in opened.last_maps()]
    runs = [MapAssembler().update(message) for message in messages if message.robot == "r1"]
    places = [place_of(run, COMMON) for run in runs if run is not None]
    assert len(places) == 2
    return se2.compose(places[0], se2.inverse(places[1]))


def place_of(robot_map: RobotMap, scan: int) -> FloatArray:
    [component] = robot_map.components
    index, poses = component_path(robot_map, component)
    [pose] = poses[index == scan]
    return np.asarray(pose)


def test_what_a_robot_mapped_before_it_was_started_again_comes_from_its_disk(
    tmp_path: Path,
) -> None:
    r1 = replace(member("r1"), scans=(40, 55))
    plan = plan_of([r1], tmp_path)
    lines = LineMap(
        np.array([[0.0, 0.0, 5.0, 0.0]]), np.zeros(1, dtype=int), np.ones(1, dtype=int), ()
    )
    submap = Submap(0, 7, np.zeros(3), lines, Trajectory.empty())
    StateFolder(plan.states / "r1").keep(RobotMap("r1", "before", 3, (submap,)))
    with ProcessGroup(tmp_path) as crew:
        start_router(crew, plan)
        start_server(crew, plan, plan.store)
        start_agent(crew, plan, r1)
        until(lambda: components(plan) == {"r1/7", "r1/8"})


def components(plan: Plan) -> set[str]:
    """Return what the latest joint map is made of."""
    joint = next(mapweave_protocol.joint_maps(plan.team, connect=[plan.listen], timeout=5.0), None)
    return {name for component in joint.components for name in component.robots} if joint else set()
