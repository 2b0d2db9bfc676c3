"""Two halves of a team, each with a router: apart they go on, together again they are one."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import pytest

from benchmarks.faults.relay import Relay
from mapweave_deploy.run.launcher import (
    ROUTER,
    Plan,
    free_endpoint,
    start_agent,
    start_router,
    start_server,
)
from mapweave_deploy.run.processes import ProcessGroup
from mapweave_protocol.link.security.roster import Role
from mapweave_protocol.link.subscriber import poses
from tests.deploy.run.test_claimants import joined_names
from tests.deploy.run.test_outages import plan_of, says, until
from tests.deploy.run.test_restarts import member

pytestmark = pytest.mark.parametrize(
    "keys", ["open", pytest.param("with keys", marks=pytest.mark.slow)], indirect=True
)


@dataclass
class Halves:
    """Two halves of a team, and the link between their routers."""

    here: Plan
    there: Plan
    crew: ProcessGroup
    others: ProcessGroup
    link: Relay


@pytest.fixture
def halves(tmp_path: Path, keys: Path | None) -> Iterator[Halves]:
    """Return the halves, their routers linked."""
    here = plan_of([replace(member("r1"), scans=(0, 55))], tmp_path, keys)
    listen = free_endpoint(encrypted=keys is not None)
    there = replace(here, members=[replace(member("r2"), scans=(0, 55))], listen=listen)
    for folder in ("here", "there"):
        (tmp_path / folder).mkdir()
    with ProcessGroup(tmp_path / "here") as crew, ProcessGroup(tmp_path / "there") as others:
        start_router(crew, here)
        with Relay(here.listen) as link:
            route = ["router", "--listen", there.listen, "--connect", link.endpoint]
            router = others.start("router", ROUTER, [*route, *there.proof(Role.ROUTER)])
            until(lambda: "listening" in router.log.read_text())
            yield Halves(here, there, crew, others, link)


def are_joined(plan: Plan) -> bool:
    return joined_names(plan) == {"r1/0", "r2/0"}


@pytest.mark.slow
def test_two_halves_with_a_coordinator_each_are_one_joint_map_after_the_link_returns(
    halves: Halves, tmp_path: Path
) -> None:
    here, there = tmp_path / "here", tmp_path / "there"
    start_server(halves.crew, halves.here, tmp_path / "here.sqlite")
    until(lambda: says(here, "server", "coordinating"))
    halves.link.sever()
    start_server(halves.others, halves.there, tmp_path / "there.sqlite")
    start_agent(halves.crew, halves.here, halves.here.members[0])
    start_agent(halves.others, halves.there, halves.there.members[0])
    until(lambda: says(here, "agent-r1", "finished:") and says(there, "agent-r2", "finished:"))
    until(lambda: joined_names(halves.here) == {"r1/0"})
    until(lambda: joined_names(halves.there) == {"r2/0"})
    halves.link.restore()
    for plan in (halves.here, halves.there):
        until(partial(are_joined, plan))
    for folder in (here, there):
        until(partial(says, folder, "server", "2 coordinators of the team are here"))


@pytest.mark.slow  # they drive for 40 s
def test_robots_cut_off_from_the_coordinator_go_on_comparing_and_are_in_one_frame(
    halves: Halves, tmp_path: Path
) -> None:
    start_server(halves.crew, halves.here, tmp_path / "here.sqlite")
    until(lambda: says(tmp_path / "here", "server", "coordinating"))
    halves.link.sever()
    team = [replace(plan.members[0], scans=(0, 70)) for plan in (halves.here, halves.there)]
    slow = replace(halves.there, rate="0.7")  # they drive until they have met
    for robot in team:
        start_agent(halves.others, slow, robot)
    frames: dict[str, str] = {}
    for pose in poses(slow.team, connect=[slow.listen], timeout=60.0):
        if pose.joint is not None:
            frames[pose.robot] = pose.joint.frame
        if frames.keys() == {"r1", "r2"}:
            break
    assert frames == {"r1": "r1/0", "r2": "r1/0"}
    assert joined_names(halves.here) is None
    halves.link.restore()
    until(lambda: joined_names(halves.here) == {"r1/0", "r2/0"})
