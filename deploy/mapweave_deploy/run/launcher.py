"""Runs a team as processes on this machine, from its start to its joint map."""

import socket
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import zenoh

from mapweave.errors import MapweaveError
from mapweave.maps import JointMap, RobotMap
from mapweave_deploy.run.display import Display
from mapweave_deploy.run.following import POLL, Follower, TeamTimeoutError, agent_of
from mapweave_deploy.run.processes import ProcessGroup
from mapweave_deploy.run.recorder import Recorder
from mapweave_deploy.run.team_plan import Member
from mapweave_fusion_server.store import Store
from mapweave_fusion_server.web.address import TOKEN_VARIABLE, HttpAddress
from mapweave_protocol.link.assembler import MapAssembler
from mapweave_protocol.link.security import roster
from mapweave_protocol.link.security.folder import place_of
from mapweave_protocol.link.security.roster import Role
from mapweave_protocol.link.security.settings import LinkSettings
from mapweave_protocol.link.session import open_session
from mapweave_protocol.wire.codec import decode
from mapweave_protocol.wire.keys import COORDINATOR_LIVE, everything
from mapweave_protocol.wire.messages import JointMapMessage, MapMessage

ROUTER, SERVER, AGENT = 0, 1, 2  # stages: agents are stopped first, the router last
ROUTER_PATIENCE = 20.0  # [s] for the router to listen, on a machine that is busy starting things
PAGE_PATIENCE = 60.0  # [s] for the coordinator to serve its page, while agents start as well
AGENT_NICENESS = 19  # of agents, beside a router and a coordinator on the same machine


class NoJointMapError(MapweaveError):
    """A coordinator that ended without a joint map."""


@dataclass(frozen=True, slots=True)
class Plan:
    """What to run.

    Attributes
    ----------
    team
        The team's name.
    members
        Its robots.
    rate
        How fast logs are played: ``max`` or times real time.
    listen
        Where the router listens, such as ``tcp/127.0.0.1:7447``.
    store
        The coordinator's file.
    states
        Folder of the agents' states, an empty one: earlier runs would be taken up.
    timeout
        When to give up [s]; None never does.
    config
        The file that says what to change of the defaults, for agents and coordinator; or None.
    page
        Where the coordinator serves the live page, the port a given one; None where it does not.
    token
        What whoever gives orders by the page must know.
    keys
        The folder of the team's keys, as ``mapweave keys`` makes it; None where all may do all.
    """

    team: str
    members: list[Member]
    rate: str
    listen: str
    store: Path
    states: Path
    timeout: float | None
    config: Path | None = None
    page: HttpAddress | None = None
    token: str = ""
    keys: Path | None = None

    @property
    def robots(self) -> list[str]:
        """The robots' ids."""
        return [member.robot for member in self.members]

    @property
    def connection(self) -> list[str]:
        """The arguments that every process of the team but the router takes."""
        return ["--team", self.team, "--connect", self.listen]

    @property
    def computing(self) -> list[str]:
        """The arguments that every process takes that computes."""
        return [] if self.config is None else ["--config", str(self.config)]

    def keys_of(self, role: Role, name: str = "") -> Path | None:
        """Return the keys of one of the team; `name` is that of its role where there is one."""
        if self.keys is None:
            return None
        return self.keys / place_of(roster.Member(self.team, role, name or role.value))

    def proof(self, role: Role, name: str = "") -> list[str]:
        """Return the arguments by which a process of the team proves who it is."""
        keys = self.keys_of(role, name)
        return [] if keys is None else ["--tls", str(keys)]


@dataclass(frozen=True, slots=True, eq=False)
class TeamOutcome:
    """What a team came to.

    Attributes
    ----------
    joint
        The last version of the joint map.
    maps
        By robot, its last map.
    recorder
        What was sent, and how far everybody came.
    lost
        Robots whose agents ended before they were done; of these, the maps up to there.
    """

    joint: JointMap
    maps: dict[str, RobotMap]
    recorder: Recorder
    lost: Sequence[str] = ()


def free_endpoint(*, encrypted: bool = False) -> str:
    """Return an endpoint on this machine with a port nobody listens at."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return f"{'tls' if encrypted else 'tcp'}/127.0.0.1:{probe.getsockname()[1]}"


def with_free_port(address: HttpAddress) -> HttpAddress:
    """Return `address`, its port one that nobody listens at if it asks for any."""
    if address.port:
        return address
    family = socket.AF_INET6 if ":" in address.host else socket.AF_INET
    with socket.socket(family) as probe:
        probe.bind((address.host, 0))
        return HttpAddress(address.host, probe.getsockname()[1])


def run_team(crew: ProcessGroup, plan: Plan, display: Display) -> TeamOutcome:
    """Start the team, follow it until it is done, stop all but the router.

    Raises
    ------
    ChildDiedError
        If router or coordinator ends, or the last of the robots.
    TeamTimeoutError
        If it takes too long.
    NoJointMapError
        If no robot placed a scan.
    """
    for robot in plan.robots:
        LinkSettings.of(plan.keys_of(Role.ROBOT, robot), None)  # what is wrong is told now
    follower = Follower(crew, plan.robots, display, plan.timeout)
    start_router(crew, plan)
    link = LinkSettings.of(plan.keys_of(Role.COORDINATOR), None)
    with (
        open_session([plan.listen], patience=ROUTER_PATIENCE, link=link) as session,
        session.declare_subscriber(everything(plan.team), follower.inbox.put),
    ):
        _start_all(crew, plan, session)
        for line in page_of(crew, plan):
            display.say(line)
        follower.follow(session, plan.team)
        crew.stop(lowest_stage=SERVER)
        follower.drain()
    return _read_outcome(plan, follower)


def start_router(crew: ProcessGroup, plan: Plan) -> None:
    """Start the router and wait until it listens."""
    crew.start("router", ROUTER, ["router", "--listen", plan.listen, *plan.proof(Role.ROUTER)])
    host, _, port = plan.listen.partition("/")[2].rpartition(":")
    _wait_until_it_listens(crew, host, int(port), "router", ROUTER_PATIENCE)


def page_of(crew: ProcessGroup, plan: Plan) -> list[str]:
    """Return the line that names the live page, once it can be opened; none where there is none."""
    if plan.page is None:
        return []
    _wait_until_it_listens(crew, plan.page.host, plan.page.port, "live page", PAGE_PATIENCE)
    return [f"Live page: {plan.page.url(plan.token)}"]


def _wait_until_it_listens(
    crew: ProcessGroup, host: str, port: int, name: str, patience: float
) -> None:
    deadline = time.monotonic() + patience
    while not _listens(host, port):
        crew.check()
        if time.monotonic() > deadline:
            raise TeamTimeoutError(patience, [name])
        time.sleep(POLL / 4)
    crew.check()


def _start_all(crew: ProcessGroup, plan: Plan, session: zenoh.Session) -> None:
    """Start the coordinator and the agents."""
    again = plan.store.exists()
    start_server(crew, plan, plan.store)
    deadline = time.monotonic() + ROUTER_PATIENCE
    # On a store of runs before, agents number on from what the coordinator holds.
    while again and not _is_coordinated(session, plan.team):
        crew.check()
        if time.monotonic() > deadline:
            raise TeamTimeoutError(ROUTER_PATIENCE, ["coordinator"])
        time.sleep(POLL)
    for member in plan.members:
        start_agent(crew, plan, member)


def _is_coordinated(session: zenoh.Session, team: str) -> bool:
    """Tell whether a coordinator of the team is there."""
    tokens = session.liveliness().get(COORDINATOR_LIVE.pattern(team=team))
    return any(reply.ok is not None for reply in tokens)


def start_server(crew: ProcessGroup, plan: Plan, store: Path) -> None:
    """Start the coordinator on `store`."""
    page = [] if plan.page is None else ["--http", plan.page.authority]
    reach = [*plan.connection, *plan.proof(Role.COORDINATOR)]
    arguments = ["server", *reach, *plan.computing, "--store", str(store), *page]
    # Others on this machine see arguments; they do not see the environment.
    crew.start("server", SERVER, arguments, {TOKEN_VARIABLE: plan.token} if page else {})


def start_agent(crew: ProcessGroup, plan: Plan, member: Member) -> None:
    """Start the agent of `member` on its part of the log."""
    first, behind_last = member.scans
    scans = ["--scans", f"{first}:{behind_last}"]
    source = ["--robot", member.robot, "--log", str(member.log), "--rate", plan.rate]
    state = ["--state", str(plan.states / member.robot)]
    reach = [*plan.connection, *plan.proof(Role.ROBOT, member.robot)]
    arguments = ["agent", *source, *scans, *state, *reach, *plan.computing]
    # On one machine all wait for the coordinator: robots' own computers do not compete with it.
    crew.start(agent_of(member.robot), AGENT, arguments, niceness=AGENT_NICENESS, needed=False)


def _listens(host: str, port: int) -> bool:
    try:
        with socket.create_connection((host.strip("[]"), port), timeout=1.0):
            return True
    except OSError:
        return False


def latest_joint(path: Path, team: str) -> JointMap | None:
    """Return the last joint map that a coordinator, now stopped, left in its store."""
    with Store(path, team) as store:
        latest = store.version(store.latest_version)
    return None if latest is None else decode(JointMapMessage, latest).unpack()


def _read_outcome(plan: Plan, follower: Follower) -> TeamOutcome:
    """Return what the coordinator, now stopped, left in its store."""
    joint = latest_joint(plan.store, plan.team)
    if joint is None:
        raise NoJointMapError("the robots placed no scan, so there is no joint map")
    with Store(plan.store, plan.team) as store:
        maps = [store.map_of(robot) for robot in plan.robots]
    robot_maps = [MapAssembler().update(decode(MapMessage, payload)) for payload in maps if payload]
    return TeamOutcome(
        joint,
        {robot_map.robot: robot_map for robot_map in robot_maps if robot_map is not None},
        follower.recorder,
        follower.lost,
    )
