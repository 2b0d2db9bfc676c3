"""Processes that claim one name: said by all who see it, and neither's work is lost."""

from dataclasses import replace
from functools import partial
from pathlib import Path

import mapweave_protocol
from mapweave_deploy.run.launcher import Plan, start_agent, start_router, start_server
from mapweave_deploy.run.processes import ProcessGroup
from mapweave_protocol.link.subscriber import robot_maps
from tests.deploy.run.test_outages import plan_of, says, until
from tests.deploy.run.test_restarts import member


def named_by_boots(folder: Path, words: str) -> bool:
    """Tell whether the coordinator has said that two runs of r1 are joined."""
    log = (folder / "server.log").read_text()
    return any(line.count("r1@") == 2 and words in line for line in log.splitlines())


def test_two_machines_with_one_id_are_both_in_the_joint_map_under_the_names_of_their_boots(
    tmp_path: Path,
) -> None:
    r1 = replace(member("r1"), scans=(0, 55))
    namesake = replace(member("r2"), robot="r1", scans=(0, 55))
    plan = plan_of([r1], tmp_path)
    elsewhere = replace(plan, states=tmp_path / "other states")
    (tmp_path / "other").mkdir()
    with ProcessGroup(tmp_path) as crew, ProcessGroup(tmp_path / "other") as others:
        start_router(crew, plan)
        start_agent(crew, plan, r1)
        start_agent(others, elsewhere, namesake)
        watched = crew.start("watch", 2, ["watch", *plan.connection])
        for folder in (tmp_path, tmp_path / "other"):
            until(partial(says, folder, "agent-r1", "finished:"))
            until(partial(says, folder, "agent-r1", "2 agents call themselves r1"))
        start_server(crew, plan, plan.store)
        until(lambda: says(tmp_path, "server", "2 agents call themselves r1"))
        until(lambda: "2 agents call themselves r1" in watched.log.read_text())
        until(lambda: named_by_boots(tmp_path, "joint map"))
        until(lambda: joined_names(plan) is not None)
        names = joined_names(plan)
        runs = {(m.robot, m.boot) for m in robot_maps(plan.team, connect=[plan.listen], timeout=3)}
    assert names == {f"{robot}@{boot}/0" for robot, boot in runs}
    assert len(runs) == 2


def joined_names(plan: Plan) -> set[str] | None:
    """Return the components that the latest joint map has as one, if it has only one."""
    joint = next(mapweave_protocol.joint_maps(plan.team, connect=[plan.listen], timeout=5.0), None)
    if joint is None or len(joint.components) != 1:
        return None
    return set(joint.components[0].robots)


def test_two_coordinators_are_told_by_all_who_see_them_and_each_holds_everything(
    tmp_path: Path,
) -> None:
    r1 = replace(member("r1"), scans=(0, 55))
    r2 = replace(member("r2"), scans=(0, 55))
    plan = plan_of([r1, r2], tmp_path)
    (tmp_path / "other").mkdir()
    with ProcessGroup(tmp_path) as crew, ProcessGroup(tmp_path / "other") as others:
        start_router(crew, plan)
        start_server(crew, plan, plan.store)
        start_agent(crew, plan, r1)
        start_agent(crew, plan, r2)
        until(lambda: says(tmp_path, "server", ": r1/0 + r2/0"))
        watched = crew.start("watch", 2, ["watch", *plan.connection])
        start_server(others, plan, tmp_path / "other.sqlite")
        warning = "2 coordinators of the team are here"
        for name in ("server", "agent-r1", "agent-r2"):
            until(partial(says, tmp_path, name, warning))
        until(lambda: says(tmp_path / "other", "server", warning))
        until(lambda: warning in watched.log.read_text())
        # What the robots found before the second one was there reaches it all the same.
        until(lambda: says(tmp_path / "other", "server", ": r1/0 + r2/0"))
        others.stop()
