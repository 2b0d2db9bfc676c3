"""A robot that follows in a stored joint map: in the team's joint map, and no witness of it."""

from collections.abc import Iterator
from functools import partial
from pathlib import Path

import numpy as np
import pytest

import mapweave_protocol
from mapweave.geometry import se2
from mapweave.io.map_files import read_map, write_joint
from mapweave.maps import JointComponent, JointMap
from mapweave_deploy.run.launcher import AGENT, Plan, start_agent, start_router, start_server
from mapweave_deploy.run.processes import ProcessGroup
from mapweave_deploy.run.team_plan import Member
from mapweave_deploy.sim.simulation import simulate
from mapweave_protocol.wire.messages import PoseMessage
from tests.deploy.run.test_outages import PATIENCE, child, plan_of, says, until
from tests.people import Operator

MAPPING, FOLLOWING = (0, 150), (150, 279)


def people(plan: Plan) -> Operator:
    return Operator(plan.team, plan.listen)


def component(joint: JointMap | None, *robots: str) -> JointComponent | None:
    """Return the component that `robots`, and no others, are in."""
    components = () if joint is None else joint.components
    names = {f"{robot}/0" for robot in robots}
    return next((each for each in components if set(each.robots) == names), None)


def follow(crew: ProcessGroup, plan: Plan, log: Path, stored: Path, output: Path) -> None:
    """Start a robot that is set down in a stored map."""
    scans = ["--scans", "{}:{}".format(*FOLLOWING)]
    source = ["--robot", "r3", "--log", str(log), "--rate", "2", *scans]
    where = [
        "--localize",
        str(stored),
        "--output",
        str(output),
        "--state",
        str(output.parent / "s"),
    ]
    crew.start("agent-r3", AGENT, ["agent", *source, *where, *plan.connection], needed=False)


def poses(plan: Plan, folder: Path) -> Iterator[PoseMessage]:
    """Yield where the third robot says that it is, until it has finished."""
    over = partial(says, folder, "agent-r3", "finished: ")
    said = mapweave_protocol.poses(
        plan.team, connect=[plan.listen], timeout=PATIENCE, stopping=over
    )
    return (pose for pose in said if pose.robot == "r3")


@pytest.mark.slow
def test_a_robot_set_down_in_the_teams_own_joint_map_is_in_it_and_adds_no_evidence(
    tmp_path: Path,
) -> None:
    first, second = simulate("arena", 2, 1, tmp_path / "logs")
    team = [
        Member(log.robot, log.log, MAPPING, "arena", np.arange(0), np.empty((0, 3)))
        for log in (first, second)
    ]
    plan = plan_of(team, tmp_path)
    stored, output = tmp_path / "joint.json", tmp_path / "r3.json"
    with ProcessGroup(tmp_path) as crew:
        start_router(crew, plan)
        start_server(crew, plan, plan.store)
        for member in team:
            start_agent(crew, plan, member)
        until(lambda: all(says(tmp_path, f"agent-{m.robot}", "finished: ") for m in team))
        until(lambda: component(people(plan).sees(), "r1", "r2"))
        before = component(people(plan).latest(), "r1", "r2")
        assert before is not None
        write_joint(stored, people(plan).latest())
        follow(crew, plan, first.log, stored, output)
        said = [pose for pose in poses(plan, tmp_path) if pose.joint is not None]
        until(lambda: component(people(plan).sees(), "r1", "r2", "r3"))
        joint = people(plan).latest()
        child(crew, "agent-r3").terminate()
        until(output.exists)
    after = component(joint, "r1", "r2", "r3")
    assert after is not None
    np.testing.assert_array_equal(after.map.support, before.map.support)
    np.testing.assert_allclose(after.map.segments, before.map.segments, atol=0.01)
    assert said
    assert len([a for a in joint.alignments if "r3/0" in (a.reference, a.other)]) == 1
    assert sum(len(s.map.segments) > 0 for s in read_map(output).submaps) == 1  # as it was stored
    truth = first.tour.pose
    origin = se2.compose(truth[0], se2.inverse(after.robots["r1/0"]))
    for pose in said:
        assert pose.joint is not None
        off = se2.between(se2.compose(origin, np.array(pose.joint.pose)), truth[pose.scan_index])
        assert np.hypot(off[0], off[1]) < 0.3
