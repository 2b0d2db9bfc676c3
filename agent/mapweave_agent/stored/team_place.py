"""How a robot that only follows in a stored map is joined to its team: at one place, no more.

The stored map is compared with the maps of the team, by this robot alone: others do not get it. Its
walls are of others' making, perhaps of robots of this very team, so they say nothing that these
have not said themselves. What is told is where the path of this robot lies: each component of it by
one alignment, which can neither contradict nor confirm another one. No clock and no network here.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple, TypeAlias

from mapweave.mapping.localization.followed import on_path
from mapweave.maps import Alignment, RobotMap, Submap, component_name
from mapweave_agent.comparison_schedule import Comparison
from mapweave_protocol.wire.messages import AlignmentMessage, MapVersion
from mapweave_protocol.wire.pairs import Run, run_of

Ends: TypeAlias = tuple[MapVersion, MapVersion]


class _Outcome(NamedTuple):
    """What came of the last comparison with a run: of which states, and what was accepted."""

    ends: Ends
    accepted: tuple[Alignment, ...]


class TeamPlace:
    """What is told of where a stored map lies in a team's maps.

    Parameters
    ----------
    known
        The stored map under the robot's name, numbered as its path is.
    """

    def __init__(self, known: RobotMap) -> None:
        self._known = known
        self._outcomes: dict[Run, _Outcome] = {}
        self._chosen: dict[str, Run] = {}  # by own component
        self._told: dict[Run, AlignmentMessage] = {}

    def is_about(self, comparison: Comparison) -> bool:
        """Tell whether the stored map was compared, and not only runs before this one."""
        return run_of(self._known) in map(run_of, (comparison.reference, comparison.other))

    def take(self, comparison: Comparison, found: Sequence[Alignment]) -> None:
        """Take in what was found of the stored map and another one."""
        first, second = comparison.reference, comparison.other
        run = run_of(second if run_of(first) == run_of(self._known) else first)
        accepted = tuple(a for a in found if a.decision == "accepted")
        self._outcomes[run] = _Outcome((MapVersion.of(first), MapVersion.of(second)), accepted)

    def news(self, path: RobotMap) -> Iterator[AlignmentMessage]:
        """Yield what is to be told of each run and is not yet.

        Parameters
        ----------
        path
            The robot's map as it is told: of what it drove, without walls.
        """
        firsts: dict[int, Submap] = {}
        for submap in path.submaps:
            firsts.setdefault(submap.component, submap)
        joins = self._joins(firsts)
        for run in self._outcomes:
            found = joins.get(run, [])
            before = self._told.get(run)
            message = AlignmentMessage.pack(path.robot, *self._outcomes[run].ends, found)
            if message != before and (found or before is not None):
                self._told[run] = message
                yield message

    def _joins(self, firsts: dict[int, Submap]) -> dict[Run, list[Alignment]]:
        """Return the one alignment of each component that was driven in, by the other's run.

        That with the run it was joined with before, as long as there is one: frames stay.
        """
        joins: dict[Run, list[Alignment]] = {}
        for number, submap in firsts.items():
            name = component_name(self._known.robot, number)
            found = {
                run: max(about, key=lambda a: a.confidence)
                for run, outcome in self._outcomes.items()
                if (about := [a for a in outcome.accepted if name in (a.reference, a.other)])
            }
            run = self._chosen.get(name)
            if run not in found:
                run = max(found, key=lambda each: found[each].confidence, default=None)
            if run is not None:
                self._chosen[name] = run
                joins.setdefault(run, []).append(on_path(found[run], name, self._known, submap))
        return joins


def path_of(robot_map: RobotMap, known: RobotMap | None) -> RobotMap:
    """Return what of a robot's map is of its own making: all of it, where it follows in none."""
    if known is None:
        return robot_map
    others = {submap.id for submap in known.submaps}
    driven = tuple(submap for submap in robot_map.submaps if submap.id not in others)
    return replace(robot_map, submaps=driven, marks=())
