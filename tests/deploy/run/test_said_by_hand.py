"""What was marked and ordered is lost with no process: others keep it as well."""

import time
from pathlib import Path

import numpy as np
import pytest

import mapweave_agent
from mapweave.geometry import se2
from mapweave.io.map_files import write_map
from mapweave.io.readers import read_scans
from mapweave.mapping.mapper import Mapper
from mapweave.marks import PlacedMark
from mapweave_deploy.run.launcher import Plan, start_agent, start_router, start_server
from mapweave_deploy.run.processes import ProcessGroup
from mapweave_deploy.run.team_plan import Member
from mapweave_deploy.sim.simulation import simulate
from tests.deploy.run.test_outages import PATIENCE, child, end, plan_of, says, until
from tests.people import Operator

SCANS = 60
VICTIM = np.array([1.5, 0.5])  # [m] from the sensor at the last scan


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    [robot] = simulate("arena", 1, 1, tmp_path_factory.mktemp("logs"))
    return robot.log


def member(robot: str, log: Path) -> Member:
    return Member(robot, log, (0, SCANS), "arena", np.empty(0, dtype=np.int64), np.empty((0, 3)))


def anna(plan: Plan) -> Operator:
    return Operator(plan.team, plan.listen, "anna")


def marks(plan: Plan) -> dict[str, PlacedMark]:
    joint = anna(plan).sees()
    components = () if joint is None else joint.components
    return {mark.label: mark for component in components for mark in component.marks}


def feed_and_mark(plan: Plan, log: Path, state: Path) -> None:
    """Drive a robot with a program of its own that marks what it sees at its last scan."""
    with mapweave_agent.Agent(
        "r1", plan.team, connect=plan.listen, patience=PATIENCE, state=state
    ) as agent:
        for scan in list(read_scans(log))[:SCANS]:
            agent.feed(scan.ranges, scan.angles[0], scan.angles[1] - scan.angles[0], scan.stamp)
            until(lambda: not agent.waiting)
        until(lambda: last_scan_is_mapped(agent))
        mistaken = agent.mark("mistake", 0.0, 0.0)
        agent.mark("victim", *VICTIM, frame="sensor")
        agent.take_back_mark(mistaken)
        until(lambda: "victim" in marks(plan))


def last_scan_is_mapped(agent: mapweave_agent.Agent) -> bool:
    return agent._run._scans_seen == SCANS


def expected(log: Path) -> np.ndarray:
    """Return where the victim is in the robot's map of the log."""
    mapper = Mapper("r1")
    for scan in list(read_scans(log))[:SCANS]:
        mapper.add(scan)
    last = mapper.finish().submaps[-1]
    pose = se2.compose(last.pose, last.trajectory.pose[-1])
    return se2.transform_points(pose, VICTIM)


@pytest.mark.slow
def test_what_a_program_marks_is_where_it_saw_it_and_comes_back_from_the_robots_disk(
    tmp_path: Path, log: Path
) -> None:
    r1 = member("r1", log)
    plan = plan_of([r1], tmp_path)
    with ProcessGroup(tmp_path) as crew:
        start_router(crew, plan)
        start_server(crew, plan, plan.store)
        feed_and_mark(plan, log, plan.states / "r1")
        [mark] = marks(plan).values()
        assert (mark.label, mark.by, mark.component) == ("victim", "r1", "r1/0")
        np.testing.assert_allclose(mark.position, expected(log), atol=0.1)
        # The robot is gone and the coordinator has lost all: another run of the robot has it.
        end(crew, child(crew, "server"))
        start_server(crew, plan, tmp_path / "empty.sqlite")
        start_agent(crew, plan, r1)
        until(lambda: "victim" in marks(plan))
        assert marks(plan)["victim"].component == "r1/0"


@pytest.mark.slow
def test_a_coordinator_that_lost_everything_gets_orders_back_from_a_robot_that_heard_them(
    tmp_path: Path, log: Path
) -> None:
    r1 = member("r1", log)
    plan = plan_of([r1], tmp_path)
    with ProcessGroup(tmp_path) as crew:
        start_router(crew, plan)
        start_server(crew, plan, plan.store)
        start_agent(crew, plan, r1)
        until(lambda: says(tmp_path, "agent-r1", "finished: "))
        until(lambda: anna(plan).sees() is not None)
        anna(plan).orders("mark", "r1", "exit", "--at", "5")
        anna(plan).orders("mark", "r1", "mistake", "--at", "6")
        anna(plan).orders("mark", "r1", "mistake", "--undo")
        until(lambda: set(marks(plan)) == {"exit"})
        # The robot is started again meanwhile: it has them on its disk.
        end(crew, child(crew, "agent r1"))
        end(crew, child(crew, "server"))
        start_server(crew, plan, tmp_path / "empty.sqlite")
        start_agent(crew, plan, r1)
        until(lambda: set(marks(plan)) == {"exit"})
        time.sleep(1.0)
        assert set(marks(plan)) == {"exit"}


@pytest.mark.slow
def test_a_robot_that_was_away_learns_what_was_ordered_and_keeps_it(
    tmp_path: Path, log: Path
) -> None:
    r1 = member("r1", log)
    plan = plan_of([r1], tmp_path)
    with ProcessGroup(tmp_path) as crew:
        start_router(crew, plan)
        start_server(crew, plan, plan.store)
        start_agent(crew, plan, r1)
        until(lambda: anna(plan).sees() is not None)
        until(lambda: says(tmp_path, "agent-r1", "finished: "))
        end(crew, child(crew, "agent r1"))
        anna(plan).orders("mark", "r1", "exit", "--at", "5")
        assert not (plan.states / "r1" / "orders").exists()
        start_agent(crew, plan, r1)
        until(lambda: (plan.states / "r1" / "orders").exists())


@pytest.mark.slow
def test_a_finished_map_is_delivered_joined_and_kept_when_its_sender_is_gone(
    tmp_path: Path, log: Path
) -> None:
    r1 = member("r1", log)
    plan = plan_of([r1], tmp_path)
    mapper = Mapper("r9")
    for scan in list(read_scans(log))[20 : SCANS + 60]:
        mapper.add(scan)
    write_map(tmp_path / "r9.json", mapper.finish())
    with ProcessGroup(tmp_path) as crew:
        start_router(crew, plan)
        start_server(crew, plan, plan.store)
        start_agent(crew, plan, r1)
        until(lambda: says(tmp_path, "agent-r1", "finished: "))
        until(lambda: anna(plan).sees() is not None)
        end(crew, child(crew, "agent r1"))
        said = anna(plan).orders("send", str(tmp_path / "r9.json"))
        assert said.startswith("delivered: r9/0, run ")
        assert "r1/0 - r9/0: accepted" in said
        until(lambda: together(plan) == {("r1/0", "r9/0")})
        again = anna(plan).orders("send", str(tmp_path / "r9.json"))  # the same run, once
        assert again.splitlines()[0] == said.splitlines()[0]
        end(crew, child(crew, "server"))
        start_server(crew, plan, plan.store)
        until(lambda: together(plan) == {("r1/0", "r9/0")})
        other = anna(plan).orders("send", str(tmp_path / "r9.json"), "--robot", "r1")
        assert other.startswith("delivered: r1/1, run ")


def together(plan: Plan) -> set[tuple[str, ...]]:
    joint = anna(plan).sees()
    components = () if joint is None else joint.components
    return {tuple(sorted(component.robots)) for component in components}
