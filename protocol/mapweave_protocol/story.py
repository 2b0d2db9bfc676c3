"""What happens in a team, told in plain lines; no network and no clock in here."""

from collections.abc import Iterator
from dataclasses import dataclass

from mapweave.confidence import percent
from mapweave.maps import Alignment, JointComponent, JointMap, RobotMap
from mapweave.revocation import objection
from mapweave_protocol.messages import AlignmentMessage, StatusMessage


@dataclass
class RobotState:
    """What is known of a robot.

    Attributes
    ----------
    boot
        Of the run that is alive, None if none is.
    """

    boot: str | None = None
    status: StatusMessage | None = None
    submaps: int = 0
    segments: int = 0

    @property
    def progress(self) -> str:
        """How far it is, in a few words."""
        if self.status is None:
            return ""
        total = f"/{self.status.scans_total}" if self.status.scans_total else ""
        return f"{self.status.scans_seen}{total} scans, {self.status.scans_placed} placed"


class Story:
    """Takes in what happens, and returns the lines that tell what is new about it."""

    def __init__(self) -> None:
        self.robots: dict[str, RobotState] = {}
        self.joint: JointMap | None = None
        self._decisions: dict[tuple[str, str], str] = {}
        self._objections: dict[tuple[str, str], int | None] = {}

    def appeared(self, robot: str, boot: str) -> Iterator[str]:
        """Tell that a run of a robot began."""
        state = self._robot(robot)
        if state.boot != boot:
            state.boot = boot
            yield f"{robot} is here"

    def left(self, robot: str, boot: str) -> Iterator[str]:
        """Tell that a run of a robot ended."""
        state = self._robot(robot)
        if state.boot == boot:
            state.boot = None
            yield f"{robot} is gone"

    def status(self, message: StatusMessage) -> Iterator[str]:
        """Tell when a robot has finished mapping."""
        state = self._robot(message.robot)
        before, state.status = state.status, message
        finished_before = before is not None and before.state == "finished"
        if message.state == "finished" and not finished_before:
            yield f"{message.robot} has finished: {state.progress}"

    def mapped(self, robot_map: RobotMap) -> Iterator[str]:
        """Tell when a robot's map has got another submap."""
        state = self._robot(robot_map.robot)
        before, state.submaps = state.submaps, len(robot_map.submaps)
        state.segments = sum(len(submap.map.segments) for submap in robot_map.submaps)
        if state.submaps != before:
            parts = len(robot_map.components)
            pieces = f" in {parts} components" if parts > 1 else ""
            yield (
                f"{robot_map.robot}: {_count(state.submaps, 'submap')}{pieces},"
                f" {_count(state.segments, 'segment')}"
            )

    def aligned(self, message: AlignmentMessage) -> Iterator[str]:
        """Tell each decision that is new."""
        for alignment in message.alignments:
            pair = alignment.reference, alignment.other
            if self._decisions.get(pair) != alignment.decision:
                self._decisions[pair] = alignment.decision
                yield (
                    f"{pair[0]} and {pair[1]}: {alignment.decision},"
                    f" confidence {percent(alignment.confidence)} ({alignment.reason})"
                )

    def joined(self, joint: JointMap) -> Iterator[str]:
        """Tell a version of the joint map, and each join that it is the first not to rely on."""
        self.joint = joint
        groups = [_tell_component(component) for component in joint.components]
        yield f"joint map {joint.version}: {', '.join(groups) or 'nothing yet'}"
        for alignment in joint.alignments:
            yield from self._objected(alignment)

    def _objected(self, alignment: Alignment) -> Iterator[str]:
        pair = alignment.reference, alignment.other
        found = objection(alignment)
        if found is None:
            self._objections.pop(pair, None)
        elif self._objections.get(pair, -1) != found.revoked:
            self._objections[pair] = found.revoked
            what = f"revoked in version {found.revoked}" if found.revoked else "not relied on"
            yield f"{pair[0]} and {pair[1]}: alignment {what} ({found.reason})"

    def _robot(self, robot: str) -> RobotState:
        return self.robots.setdefault(robot, RobotState())


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}{'' if number == 1 else 's'}"


def _tell_component(component: JointComponent) -> str:
    names = " + ".join(sorted(component.robots))
    return names if len(component.robots) == 1 else f"{names} ({percent(component.confidence)})"
