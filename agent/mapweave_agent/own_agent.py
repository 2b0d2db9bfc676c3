"""An agent within a program of one's own, such as a driver: it is fed scan by scan."""

import logging
import math
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from types import TracebackType
from typing import Self, TypeVar

from numpy.typing import ArrayLike

from mapweave.commands.starting import Start
from mapweave.config import Config
from mapweave.errors import ArgumentError, MapweaveError
from mapweave.fusion.align import FusionParameters, align
from mapweave.ids import check_id
from mapweave.mapping.localization.known_map import KnownMap
from mapweave.maps import JointMap, RobotMap
from mapweave.scan.scan import Scan, check_beams
from mapweave.text import shown
from mapweave_agent.agent import AgentRun
from mapweave_agent.by_hand.own_marks import Frame, checked
from mapweave_agent.comparison_worker import ComparisonWorker
from mapweave_agent.live.scans import LiveScans
from mapweave_agent.publication_schedule import AgentParameters
from mapweave_agent.stored.mappers import mapper_of
from mapweave_agent.taking_up import RESUME_WITHIN, EarlierRuns
from mapweave_protocol.link.arguments import DEFAULT_TEAM
from mapweave_protocol.link.security.membership import check_member
from mapweave_protocol.link.security.roster import Member, Role
from mapweave_protocol.link.security.settings import LinkSettings
from mapweave_protocol.link.session import open_session
from mapweave_protocol.link.subscriber import alignments, joint_maps, poses
from mapweave_protocol.wire.keys import new_boot
from mapweave_protocol.wire.messages import AlignmentMessage, PoseMessage

T = TypeVar("T")

_log = logging.getLogger(__name__)


class Agent:
    """A robot of a team, fed by the program that it is part of; a context manager.

    Mapping is done in a thread of its own, comparing and closing of loops in processes: a program
    that starts one is to keep its own start under ``if __name__ == "__main__":``, as
    `multiprocessing` asks. At the end of the block the map is finished and published.

    Parameters
    ----------
    robot, team
        Ids: the robot's, and its team's.
    connect
        Endpoints of the router; by default ``MAPWEAVE_CONNECT`` or this machine.
    config
        Sensor, robot and numbers of mapping.
    on_joint_map
        Called with each version of the team's joint map, in a thread of its own.
    on_pose
        Called with where each robot of the team is, this one included, at the rate of its scans,
        in a thread of its own; where it takes longer, with the newest of each.
    on_alignment
        Called with what was found out about each pair of the team's maps, this robot's or not:
        how one lies in the other, or why that is not known; in a thread of its own.
    patience
        How long the router is tried [s]; None for as long as it takes.
    state
        The folder in which the robot's runs are kept; by default that of its team and name.
    continued
        A stored map that the run goes on from, as with ``--continue``.
    localize_in
        A stored map in which the robot finds itself, and that stays as it is, as with
        ``--localize``.

    Raises
    ------
    InvalidIdError
        If `robot` or `team` is no id.
    ArgumentError
        If a map is given both to go on from and to be found in.

    Examples
    --------
    ::

        with mapweave_agent.Agent(robot="r1", team="rescue") as agent:
            for sweep in my_lidar:
                agent.feed(sweep.ranges, angle_min=-1.57, angle_increment=0.01745, stamp=sweep.time)
    """

    def __init__(
        self,
        robot: str,
        team: str = DEFAULT_TEAM,
        *,
        connect: str | Sequence[str] | None = None,
        config: Config | None = None,
        on_joint_map: Callable[[JointMap], None] | None = None,
        on_pose: Callable[[PoseMessage], None] | None = None,
        on_alignment: Callable[[AlignmentMessage], None] | None = None,
        patience: float | None = None,
        state: str | Path | None = None,
        continued: RobotMap | None = None,
        localize_in: RobotMap | JointMap | None = None,
    ) -> None:
        if continued is not None and localize_in is not None:
            raise ArgumentError("localize_in", "expected none beside continued, got both")
        self._robot = check_id("robot", robot)
        self._team = check_id("team", team)
        self._endpoints = (connect,) if isinstance(connect, str) else connect
        self._config = Config() if config is None else config
        self._on_joint_map = on_joint_map
        self._on_pose = on_pose
        self._on_alignment = on_alignment
        self._patience = patience
        self._state = None if state is None else Path(state)
        place = None if localize_in is None else KnownMap.of(localize_in)
        self._start = Start(continued, place)
        self._scans = LiveScans()
        self._leaving = threading.Event()
        self._failure: BaseException | None = None
        self._fed = 0
        self._within = False  # its block
        self._opened = ExitStack()

    @property
    def skipped(self) -> int:
        """How many scans came faster than they could be mapped, and are not in the map."""
        return self._scans.skipped

    @property
    def waiting(self) -> int:
        """How many scans were fed and are still to be mapped; few, or the oldest is skipped."""
        return self._scans.waiting

    @property
    def robot_map(self) -> RobotMap:
        """The robot's map as it was published last; after the block, all of it."""
        return self._run.robot_map

    def feed(
        self,
        ranges: ArrayLike,
        angle_min: float,
        angle_increment: float,
        stamp: float = math.nan,
        *,
        range_min: float = 0.0,
        range_max: float = math.inf,
        time_increment: float = 0.0,
        odometry: ArrayLike | None = None,
    ) -> None:
        """Hand over a scan; returns at once. Parameters as of `mapweave.Scan.of`.

        Odometry is one more guess of where the robot has got to; what was seen decides.

        Raises
        ------
        ArgumentError
            If it is no scan, or one of few beams.
        MapweaveError
            If the agent has failed, or outside of its block.
        """
        self._check_running()
        scan = Scan.of(
            ranges,
            angle_min,
            angle_increment,
            range_min=range_min,
            range_max=range_max,
            index=self._fed,
            stamp=stamp,
            time_increment=time_increment,
            odometry=odometry,
        )
        self._scans.put(check_beams(scan))
        self._fed += 1

    def mark(self, label: str, x: float, y: float, *, frame: Frame = "map") -> str:
        """Mark a place, such as a victim, on the robot's map; return the mark's id.

        The mark moves with every correction of the map, and is in the team's joint map.

        Parameters
        ----------
        label
            What is there; 1 to 64 printable characters.
        x, y
            Where [m].
        frame
            Of what: ``map``, the robot's own map as of `PoseMessage.pose`, or ``sensor``, the
            sensor at the last scan that is mapped: x ahead, y to the left.

        Raises
        ------
        ArgumentError
            If one of these cannot be used, or nothing is mapped yet.
        MapweaveError
            If the agent has failed.
        """
        self._check_running()
        return self._run.mark(label, checked(label, x, y, frame), frame)

    def take_back_mark(self, mark: str) -> None:
        """Take a mark of this agent back, by its id.

        Raises
        ------
        ArgumentError
            If there is none.
        """
        self._run.take_back_mark(mark)

    def __enter__(self) -> Self:
        """Join the team; returns once the router has answered.

        Raises
        ------
        UnreachableError
            If it has not for `patience`.
        """
        with ExitStack() as stack:
            self._run = self._open(stack)
            self._opened = stack.pop_all()
        self._threads = [threading.Thread(target=self._map, args=(self._run,), name=self._robot)]
        for listen in self._listeners():
            self._threads.append(threading.Thread(target=listen))
        for thread in self._threads:
            thread.start()
        self._within = True
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Finish the map, publish it and leave; at once where the block failed."""
        self._within = False
        if error is not None:
            self._leaving.set()
        self._scans.close()
        for thread in self._threads:
            thread.join()
        self._opened.close()
        if error is None:
            self._check_failure()

    def _open(self, stack: ExitStack) -> AgentRun:
        link = LinkSettings.of_environment()
        check_member(link, Member(self._team, Role.ROBOT, self._robot))
        earlier = EarlierRuns.of(self._team, self._robot, self._state)
        compare = partial(align, parameters=FusionParameters.of(self._config))
        session = stack.enter_context(
            open_session(self._endpoints, patience=self._patience, on_wait=_tell_waiting, link=link)
        )
        comparer = stack.enter_context(ComparisonWorker(compare))
        mapper = stack.enter_context(
            mapper_of(self._start, self._robot, new_boot(), self._config, live=True)
        )
        return AgentRun(
            lambda: session,
            self._team,
            mapper,
            comparer,
            None,
            AgentParameters(),
            earlier.folder,
            earlier.young(RESUME_WITHIN),
            earlier.first_component(session, self._team, self._robot),
        )

    def _map(self, run: AgentRun) -> None:
        """Map what is fed, until the map is finished or the program leaves."""
        try:
            run.run_live(self._scans, lambda: run.finished or self._leaving.is_set())
        except BaseException as error:  # noqa: BLE001 - handed to the program's own thread
            self._failure = error
        finally:
            self._leaving.set()

    def _listeners(self) -> Iterator[Callable[[], None]]:
        """Yield what tells the program what it asked for, until it leaves."""
        if self._on_joint_map is not None:
            yield partial(self._listen, joint_maps, self._on_joint_map)
        if self._on_pose is not None:
            yield partial(self._listen, poses, self._on_pose)
        if self._on_alignment is not None:
            yield partial(self._listen, alignments, self._on_alignment)

    def _listen(self, subscribe: Callable[..., Iterator[T]], tell: Callable[[T], None]) -> None:
        for heard in subscribe(self._team, connect=self._endpoints, stopping=self._leaving.is_set):
            tell(heard)

    def _check_running(self) -> None:
        self._check_failure()
        if not self._within:
            raise MapweaveError("an agent is used within its block: with Agent(...) as agent:")

    def _check_failure(self) -> None:
        if self._failure is not None:
            raise self._failure


def _tell_waiting(reason: str) -> None:
    # A warning: a program that has set up no log shows it as well.
    _log.warning("waiting for a router: %s", shown(reason, 300))
