"""The maps of a robot's team, one for each run; no clock and no network in here."""

from dataclasses import dataclass, field

from mapweave.maps import RobotMap, component_name
from mapweave_protocol.wire.messages import JointStatusMessage, MapVersion
from mapweave_protocol.wire.pairs import is_earlier_run, name_with_boot, run_of

MAX_RUNS = 64  # of one robot


@dataclass
class _Robot:
    """What is known of a robot.

    Attributes
    ----------
    maps
        The newest of each run, by boot; that heard of last at the end.
    newest
        The boot of the last run that has a map.
    boots
        The runs that are alive.
    gone
        Whether there were some, and are no longer; a map may be here before its run's token.
    last
        By boot, the version of the map that was said to be its last.
    """

    maps: dict[str, RobotMap] = field(default_factory=dict)
    newest: str | None = None
    boots: set[str] = field(default_factory=set)
    gone: bool = False
    last: dict[str, int] = field(default_factory=dict)

    @property
    def current(self) -> list[str]:
        """The boots of the runs that are alive and have a map, and of the last there was."""
        return [boot for boot in self.maps if boot in self.boots or boot == self.newest]


class TeamMaps:
    """The maps of the runs of others, and which of these are alive."""

    def __init__(self) -> None:
        self._robots: dict[str, _Robot] = {}

    def take(self, robot_map: RobotMap) -> None:
        """Take in the map of a run, unless a newer one of it is known."""
        robot = self._robot(robot_map.robot)
        before = robot.maps.pop(robot_map.boot, robot_map)
        newer = robot_map if before.version <= robot_map.version else before
        robot.maps[robot_map.boot] = newer
        newest = None if robot.newest is None else robot.maps[robot.newest]
        if newest is None or not is_earlier_run(newer, newest):
            robot.newest = robot_map.boot
        if len(robot.maps) > MAX_RUNS:
            del robot.maps[next(boot for boot in robot.maps if boot != robot.newest)]

    def note_last(self, robot: str, boot: str, version: int) -> None:
        """Note that the map of that version is the last of a run."""
        last = self._robot(robot).last
        last[boot] = version
        if len(last) > MAX_RUNS:
            del last[next(iter(last))]

    def here(self, robot: str, boot: str) -> None:
        """Note that a run is alive."""
        named = self._robot(robot)
        if len(named.boots) < MAX_RUNS:  # tokens cost those who hold them nothing
            named.boots.add(boot)
        named.gone = False

    def left(self, robot: str, boot: str) -> None:
        """Note that a run is no longer alive."""
        named = self._robot(robot)
        named.boots.discard(boot)
        named.gone = not named.boots

    def knows(self, robot: str) -> bool:
        """Tell whether a map of a robot is here."""
        return robot in self._robots and bool(self._robots[robot].maps)

    def version_of(self, robot: str, boot: str) -> int | None:
        """Return which version of the map of a run is here, None if none is."""
        held = self._robots[robot].maps.get(boot) if robot in self._robots else None
        return None if held is None else held.version

    def current_version_of(self, robot: str, boot: str) -> int | None:
        """Return the same; None also where the run is neither alive nor the robot's last."""
        is_current = robot in self._robots and boot in self._robots[robot].current
        return self.version_of(robot, boot) if is_current else None

    def drop(self, robot: str, boot: str) -> None:
        """Drop the map of a run: it was not from it."""
        named = self._robot(robot)
        named.maps.pop(boot, None)
        if named.newest == boot:
            named.newest = next(reversed(named.maps), None)

    def forget(self, robot: str) -> None:
        """Forget a robot."""
        self._robots.pop(robot, None)

    def note_map_of(self, robot: str) -> None:
        """Note that a coordinator holds a map of a robot: one that is not here has gone."""
        named = self._robot(robot)
        named.gone = not named.boots

    def holds(self, state: MapVersion) -> bool:
        """Tell whether a map is here, in this state or a newer one."""
        robot_map = self._robot(state.robot).maps.get(state.boot)
        return robot_map is not None and robot_map.version >= state.version

    def is_gone(self, robot: str) -> bool:
        """Tell whether a robot was here and is no longer."""
        return robot in self._robots and self._robots[robot].gone

    def is_last(self, robot_map: RobotMap) -> bool:
        """Tell whether a map is the last of its run."""
        last = self._robot(robot_map.robot).last
        return last.get(robot_map.boot) == robot_map.version or self.is_over(robot_map)

    def is_over(self, robot_map: RobotMap) -> bool:
        """Tell whether the run of a map is followed by another one."""
        return robot_map.boot not in self._robot(robot_map.robot).current

    @property
    def all(self) -> list[RobotMap]:
        """Every run's map."""
        return [robot_map for robot in self._robots.values() for robot_map in robot.maps.values()]

    @property
    def newest(self) -> list[RobotMap]:
        """The map of the last run of each robot."""
        return [each.maps[each.newest] for each in self._robots.values() if each.newest is not None]

    @property
    def current(self) -> list[RobotMap]:
        """The maps of the runs that are alive, and of each robot's last one."""
        robots = (self._robots[name] for name in sorted(self._robots))
        return [robot.maps[boot] for robot in robots for boot in sorted(robot.current)]

    def _robot(self, name: str) -> _Robot:
        return self._robots.setdefault(name, _Robot())


class JoinedRuns:
    """Which runs the joint map has in one frame, as a coordinator has said last."""

    def __init__(self) -> None:
        self._frame: dict[str, str] = {}

    def take(self, status: JointStatusMessage) -> None:
        """Take in the frames of a coordinator."""
        self._frame = {name: place.frame for name, place in status.frames.items()}

    def tells(self, one: RobotMap, another: RobotMap) -> bool:
        """Tell whether parts of two runs' maps are joined."""
        return not self._frames(one).isdisjoint(self._frames(another))

    def _frames(self, robot_map: RobotMap) -> set[str]:
        names = robot_map.robot, name_with_boot(run_of(robot_map))
        components = (component_name(n, c) for n in names for c in robot_map.components)
        return {self._frame[name] for name in components if name in self._frame}
