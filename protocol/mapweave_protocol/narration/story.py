"""What happens in a team, told in plain lines; no network and no clock in here."""

from collections.abc import Iterator
from dataclasses import dataclass, field

from mapweave.maps import JointMap, RobotMap, component_name
from mapweave.text import counted
from mapweave_protocol.link.claimants import MOST, Claimants, tell_coordinators, tell_robots
from mapweave_protocol.narration.story_alignments import AlignmentStory
from mapweave_protocol.narration.story_joint import JointStory
from mapweave_protocol.narration.story_said import SaidStory
from mapweave_protocol.wire.messages import AlignmentMessage, MapVersion, StatusMessage
from mapweave_protocol.wire.pairs import is_earlier_run


@dataclass
class RobotState:
    """What is known of a robot.

    Attributes
    ----------
    claimants
        The runs of it that are alive: one, where nothing is wrong.
    map
        Its last map.
    told
        How many submaps its map had when that was told last.
    parts
        The names of all components that the run of `map` has had.
    finished
        The runs that were told to have finished.
    """

    claimants: Claimants = field(default_factory=Claimants)
    status: StatusMessage | None = None
    map: RobotMap | None = None
    told: int = 0
    parts: set[str] = field(default_factory=set)
    finished: set[str] = field(default_factory=set)

    @property
    def here(self) -> bool:
        """Whether a run of it is alive."""
        return bool(self.claimants.boots)

    def is_of_namesake(self, robot_map: RobotMap) -> bool:
        """Tell whether a map is of another run than `map`, which is alive and not before it."""
        if self.map is None or self.map.boot not in self.claimants.boots - {robot_map.boot}:
            return False
        return not is_earlier_run(self.map, robot_map)

    @property
    def progress(self) -> str:
        """How far it is, in a few words."""
        if self.status is None:
            return ""
        total = f"/{self.status.scans_total}" if self.status.scans_total else ""
        return f"{self.status.scans_seen}{total} scans, {self.status.scans_placed} placed"

    @property
    def submaps(self) -> int:
        """How many submaps its map has."""
        return len(self.map.submaps) if self.map else 0

    @property
    def segments(self) -> int:
        """How many segments its submaps have, each counted for itself."""
        return sum(len(s.map.segments) for s in self.map.submaps) if self.map else 0


class Story:
    """Takes in what happens, and returns the lines that tell what is new about it."""

    def __init__(self) -> None:
        self.robots: dict[str, RobotState] = {}
        self._alignments = AlignmentStory()
        self._joint = JointStory()
        self._said = SaidStory()
        self._coordinators = Claimants()

    @property
    def joint(self) -> JointMap | None:
        """The last version of the joint map."""
        return self._joint.joint

    def appeared(self, robot: str, boot: str) -> Iterator[str]:
        """Tell that a run of a robot began, and if it is not the only one."""
        state = self._robot(robot)
        before = state.here
        count = state.claimants.take(boot, here=True)
        if count:
            yield tell_robots(robot, count)
        elif not before:
            yield f"{robot} is here"

    def left(self, robot: str, boot: str) -> Iterator[str]:
        """Tell that a run of a robot ended."""
        state = self._robot(robot)
        before = state.here
        state.claimants.take(boot, here=False)
        if before and not state.here:
            yield f"{robot} is gone"

    def coordinator(self, boot: str, *, here: bool) -> Iterator[str]:
        """Tell when a team has more than one coordinator."""
        count = self._coordinators.take(boot, here=here)
        if count:
            yield tell_coordinators(count)

    def status(self, message: StatusMessage) -> Iterator[str]:
        """Tell that a run of a robot has finished mapping, once."""
        state = self._robot(message.robot)
        state.status = message
        is_told = message.boot in state.finished or len(state.finished) >= MOST
        if message.state == "finished" and not is_told:
            state.finished.add(message.boot)
            yield f"{message.robot} has finished: {state.progress}"

    def mapped(self, robot_map: RobotMap) -> Iterator[str]:
        """Tell that a robot lost its way or found it, and when its map is twice what was told."""
        state = self._robot(robot_map.robot)
        if state.map is not None and (
            is_earlier_run(robot_map, state.map) or state.is_of_namesake(robot_map)
        ):
            return
        before, state.map = state.map, robot_map
        if before is not None and before.boot == robot_map.boot:
            yield from _tell_lost(before, robot_map)
            yield from _tell_found(before, robot_map)
        else:
            state.told, state.parts = 0, set()
        state.parts |= {component_name(robot_map.robot, c) for c in robot_map.components}
        if state.submaps >= max(2 * state.told, 1):
            state.told = state.submaps
            yield (
                f"{robot_map.robot}: {counted(state.submaps, 'submap')}{_pieces(robot_map)},"
                f" {counted(state.segments, 'segment')}"
            )

    def aligned(self, message: AlignmentMessage) -> Iterator[str]:
        """Tell what is new about how two robots' maps lie to each other."""
        past = self._past(message.reference) | self._past(message.other)
        yield from self._alignments.decided(message, past)

    def joined(self, joint: JointMap) -> Iterator[str]:
        """Tell what is new about the joint map, and each join that it is the first not to use."""
        yield from self._joint.changed(joint)
        yield from self._alignments.judged(joint)
        yield from self._said.changed(joint)

    def _past(self, compared: MapVersion) -> set[str]:
        """Return the parts of a robot that became one with others since they were compared."""
        state = self._robot(compared.robot)
        if state.map is None or state.map.boot != compared.boot:
            return set()
        if state.map.version < compared.version:
            return set()
        return state.parts - {component_name(compared.robot, c) for c in state.map.components}

    def _robot(self, robot: str) -> RobotState:
        return self.robots.setdefault(robot, RobotState())


def _tell_lost(before: RobotMap, now: RobotMap) -> Iterator[str]:
    for component in sorted(set(now.components) - set(before.components)):
        yield f"{now.robot} lost its way: {component_name(now.robot, component)} begins"


def _tell_found(before: RobotMap, now: RobotMap) -> Iterator[str]:
    part_of = {submap.id: submap.component for submap in now.submaps}
    for component in sorted(set(before.components) - set(now.components)):
        ids = [s.id for s in before.submaps if s.component == component and s.id in part_of]
        if ids:
            name = component_name(now.robot, component)
            whole = component_name(now.robot, part_of[ids[0]])
            yield f"{now.robot} found its way: {name} is a part of {whole}"


def _pieces(robot_map: RobotMap) -> str:
    parts = len(robot_map.components)
    return f" in {parts} components" if parts > 1 else ""
