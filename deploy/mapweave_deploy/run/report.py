"""What a team came to, in words and as values."""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Self

import numpy as np

from mapweave.io.map_files import alignment_content
from mapweave.maps import Alignment, JointComponent, RobotMap
from mapweave.text import counted, percent
from mapweave_deploy.run.evaluation import (
    Limits,
    PairEvaluation,
    judge,
    main_component,
    scan_counts,
)
from mapweave_deploy.run.key_scans import APART, key_scan_bytes, path_length
from mapweave_deploy.run.launcher import TeamOutcome
from mapweave_deploy.run.occupancy import grid_bytes
from mapweave_deploy.run.team_plan import Member
from mapweave_protocol.wire.messages import StatusMessage

WORLD_LIMITS = Limits(0.3, np.radians(3.0))
LOG_LIMITS = Limits(0.5, np.radians(5.0))
SIMULATED = "the simulated truth"
LOGGED = "the poses in the log (as good as the program that wrote them)"


def tell_outcome(outcome: TeamOutcome, members: Sequence[Member]) -> Iterator[str]:
    """Yield what happened: who joined whom, what was not joined and why, what was sent."""
    yield ""
    yield from _tell_robots(outcome, members)
    yield from _tell_alignments(outcome.joint.alignments)
    yield f"Joint map, version {outcome.joint.version}:"
    for component in outcome.joint.components:
        yield f"  {_tell_component(component)}"
    yield from _tell_traffic(outcome, members)


def tell_files(files: Sequence[tuple[str, Path]]) -> Iterator[str]:
    """Yield the files that were written."""
    width = max(len(kind) for kind, _ in files) + 1
    yield "Written:"
    for kind, path in files:
        yield f"  {kind + ':':{width}} {path}"


def _tell_robots(outcome: TeamOutcome, members: Sequence[Member]) -> Iterator[str]:
    yield "Robots:"
    for member in members:
        status = outcome.recorder.statuses.get(member.robot)
        ended = "; ended before it was done" if member.robot in outcome.lost else ""
        yield f"  {member.robot}: {_tell_robot(status)}{ended}"


def _tell_robot(status: StatusMessage | None) -> str:
    if status is None:
        return "was never heard"
    parts = f", {status.components} components" if status.components > 1 else ""
    return (
        f"{status.scans_placed} of {status.scans_seen} scans placed,"
        f" {counted(status.submaps, 'submap')}{parts}"
    )


def _tell_alignments(alignments: Sequence[Alignment]) -> Iterator[str]:
    yield "Who joined whom:"
    joined = [a for a in alignments if a.decision == "accepted"]
    for alignment in joined:
        sure = percent(alignment.confidence)
        yield f"  {_names(alignment)}, confidence {sure}: {alignment.reason}"
    if not joined:
        yield "  nobody"
    others = [a for a in alignments if a.decision != "accepted"]
    if others:
        yield "What was not joined:"
    for alignment in others:
        yield f"  {_names(alignment)}, {alignment.decision}: {alignment.reason}"


def _names(alignment: Alignment) -> str:
    return f"{alignment.reference} and {alignment.other}"


def _tell_component(component: JointComponent) -> str:
    names = " + ".join(sorted(component.robots))
    segments = f"{len(component.map.segments)} segments"
    if len(component.robots) == 1:
        return f"{names} alone, {segments}"
    return f"{names}, confidence {percent(component.confidence)}, {segments}"


@dataclass(frozen=True, slots=True)
class Verdicts:
    """Whether what was joined is right.

    Attributes
    ----------
    pairs
        Of the pairs of robots that were joined.
    limits
        How far from the truth is right still.
    truth
        What that is, in words.
    """

    pairs: list[PairEvaluation]
    limits: Limits
    truth: str

    @classmethod
    def of(cls, outcome: TeamOutcome, members: Sequence[Member], *, simulated: bool) -> Self:
        """Judge by the truth of a simulated world, or by the poses in logs."""
        limits = WORLD_LIMITS if simulated else LOG_LIMITS
        pairs = list(judge(outcome.joint, outcome.maps, members, limits))
        return cls(pairs, limits, SIMULATED if simulated else LOGGED)


def tell_verdicts(
    outcome: TeamOutcome, members: Sequence[Member], verdicts: Verdicts
) -> Iterator[str]:
    """Yield how many components there are, and whether what was joined is right."""
    yield from _tell_components(outcome, members, verdicts.pairs)
    for pair in verdicts.pairs:
        yield f"  {pair.reference} and {pair.other}: {_tell_error(pair)}"
    judged = [pair.right for pair in verdicts.pairs if pair.right is not None]
    if judged:
        limits = verdicts.limits
        yield (
            f"{sum(judged)} of {len(judged)} joined pairs are right within {limits.distance:g} m"
            f" and {np.degrees(limits.angle):g}° of {verdicts.truth}."
        )


def outcome_content(
    outcome: TeamOutcome,
    members: Sequence[Member],
    files: Sequence[tuple[str, Path]],
    verdicts: Verdicts,
) -> dict[str, object]:
    """Return what is told of a team, as values."""
    return {
        "robots": {member.robot: _robot_content(outcome, member.robot) for member in members},
        "version": outcome.joint.version,
        "components": [
            {
                "robots": sorted(component.robots),
                "confidence": component.confidence,
                "segments": len(component.map.segments),
            }
            for component in outcome.joint.components
        ],
        "alignments": [alignment_content(alignment) for alignment in outcome.joint.alignments],
        "judged": [_pair_content(pair) for pair in verdicts.pairs],
        "files": {kind: str(path) for kind, path in files},
    }


def _robot_content(outcome: TeamOutcome, robot: str) -> dict[str, object]:
    status = outcome.recorder.statuses.get(robot)
    sent = outcome.recorder.sent(robot)
    return {
        "scans": None if status is None else status.scans_seen,
        "placed": None if status is None else status.scans_placed,
        "lost": robot in outcome.lost,
        "bytes": {kind: count.size for kind, count in sent.items()},
    }


def _pair_content(pair: PairEvaluation) -> dict[str, object]:
    known = pair.right is not None
    return {
        "reference": pair.reference,
        "other": pair.other,
        "right": None if pair.right is None else bool(pair.right),
        "distance_m": float(pair.distance) if known else None,
        "angle_deg": float(np.degrees(pair.angle)) if known else None,
    }


def _tell_components(
    outcome: TeamOutcome, members: Sequence[Member], verdicts: Sequence[PairEvaluation]
) -> Iterator[str]:
    """Yield in how many components the robots are, and what is left over."""
    mains = {main_component(robot_map) for robot_map in outcome.maps.values()}
    homes = [c for c in outcome.joint.components if not mains.isdisjoint(c.robots)]
    yield f"{counted(len(members), 'robot')} in {counted(len(homes), 'component')}."
    places = len({member.place for member in members})
    if places > 1 and all(verdict.right is not None for verdict in verdicts):
        yield f"Nothing is joined across the {places} logs."
    for component in outcome.joint.components:
        if mains.isdisjoint(component.robots):
            yield f"  joined to none of them: {_tell_rest(component, outcome)}"
    if not verdicts and any(len(component.robots) > 1 for component in outcome.joint.components):
        yield "What was joined cannot be judged: there are no poses in the log."


def _tell_rest(component: JointComponent, outcome: TeamOutcome) -> str:
    """Tell a component that no robot's main part is in, and how many scans it has."""
    counts = sum(map(scan_counts, outcome.maps.values()), Counter[str]())
    scans = sum(counts[name] for name in component.robots)
    return f"{' + '.join(sorted(component.robots))} ({counted(scans, 'scan')})"


def _tell_error(verdict: PairEvaluation) -> str:
    if verdict.right is None:
        return "joined across logs, which is right only if these are of one building"
    error = f"off by {verdict.distance:.3f} m and {np.degrees(verdict.angle):.1f}°"
    return f"right, {error}" if verdict.right else f"WRONG, {error}"


def _tell_traffic(outcome: TeamOutcome, members: Sequence[Member]) -> Iterator[str]:
    yield "What each robot sent, bytes for each metre it drove:"
    for member in members:
        counts = outcome.recorder.sent(member.robot)
        robot_map = outcome.maps.get(member.robot)
        metres = 0.0 if robot_map is None else path_length(robot_map)
        total = sum(count.size for count in counts.values())
        kinds = ", ".join(
            f"{kind} {_rate(count.size, metres)} in {counted(count.messages, 'message')}"
            for kind, count in counts.items()
        )
        yield f"  {member.robot}: {_size(total)}, {_rate(total, metres)} a metre: {kinds}"
        if robot_map is not None:
            yield from (f"      {line}" for line in _tell_others(robot_map, member, metres))


def _tell_others(robot_map: RobotMap, member: Member, metres: float) -> Iterator[str]:
    """Yield what others would send of the same scans."""
    keys = key_scan_bytes(member, robot_map)
    plain, deflated = grid_bytes(member, robot_map)
    yield (
        f"the same drive as scans every {APART:g} m, deflated: {_size(keys)},"
        f" {_rate(keys, metres)} a metre"
    )
    yield (
        f"the same scans as an occupancy grid of 5 cm, once: {_size(plain)},"
        f" deflated {_size(deflated)}"
    )


def _rate(count: int, metres: float) -> str:
    return f"{count / metres:.0f} B" if metres else f"{count} B"


def _size(count: int) -> str:
    return f"{count / 1000:.1f} kB"
