"""Which robots have seen a place in common, by shape alone: whose maps are worth comparing.

Every submap is looked up once among those of all other runs. So what a team pays grows with the
submaps that there are, not with the pairs of maps. It is looked up when somebody wants to know, not
when it comes: of one that grows meanwhile only the last state is.
"""

from typing import TypeAlias

from pydantic import Field

from mapweave.config import Config
from mapweave.geometry.segments import lengths
from mapweave.maps import RobotMap, Submap
from mapweave.matching.place_index import Place, PlaceIndex, PlaceIndexParameters
from mapweave.parameters import StageParameters, derived

Run: TypeAlias = tuple[str, str]  # robot and boot
Key: TypeAlias = tuple[str, str, int]  # and submap


class EncounterParameters(StageParameters):
    """When a submap is looked up, and how far down the list places count.

    With 6 runs and 4 m, of 56 stretches of five buildings 4 % of the pairs that are joined have no
    place in common, and none of the robots is left apart by that; nine more are compared for each
    robot.
    """

    index: PlaceIndexParameters = derived(PlaceIndexParameters.of)
    min_wall: float = Field(4.0, gt=0, description="[m] of a submap that is looked up")
    growth: float = Field(0.3, gt=0, description="share of wall by which one counts as new")
    places: int = Field(40, ge=1, description="of a submap that are looked at, the best")
    runs: int = Field(6, ge=1, description="that these are of and that count, the best")
    score: float = Field(4.0, gt=0, description="[m] of a place that makes an encounter likely")


class Encounters:
    """What the submaps of a team say of each other: what has been taken in and looked up."""

    def __init__(self, parameters: EncounterParameters | None = None) -> None:
        self._p = parameters or EncounterParameters.of(Config())
        self._index: PlaceIndex[Key] = PlaceIndex(self._p.index)
        self._walls: dict[Run, dict[int, float]] = {}  # [m] when it was, or is to be, looked up
        self._waiting: dict[Key, Submap] = {}
        self._best: dict[Run, dict[Run, float]] = {}  # both ways

    def take(self, robot_map: RobotMap) -> None:
        """Take in a map; only what is new of it waits to be looked up."""
        run = robot_map.robot, robot_map.boot
        walls = self._walls.setdefault(run, {})
        for gone in walls.keys() - {submap.id for submap in robot_map.submaps}:
            del walls[gone]
            self._waiting.pop((*run, gone), None)
            self._index.discard((*run, gone))
        for submap in robot_map.submaps:
            wall = float(lengths(submap.map.segments).sum())
            known = walls.get(submap.id, 0.0)
            if wall >= self._p.min_wall and not known <= wall < known * (1 + self._p.growth):
                walls[submap.id] = wall
                self._waiting[*run, submap.id] = submap

    @property
    def is_behind(self) -> bool:
        """Whether anything that was taken in waits to be looked up."""
        return bool(self._waiting)

    def catch_up(self, most: int | None = None) -> None:
        """Look up what waits, what waits longest first; no more than `most` submaps if told."""
        for key in list(self._waiting)[:most]:
            self._look_up(key, self._waiting.pop(key))

    def score(self, one: Run, other: Run) -> float:
        """[m] of the best place that two runs had in common; 0 without."""
        return self._best.get(one, {}).get(other, 0.0)

    def likely(self, one: Run, other: Run) -> bool:
        """Tell whether shapes say that two runs saw one place."""
        return self.score(one, other) >= self._p.score

    def likely_of(self, run: Run) -> list[Run]:
        """Return the runs that, shapes say, saw a place in common with `run`."""
        return [other for other, s in self._best.get(run, {}).items() if s >= self._p.score]

    def _look_up(self, key: Key, submap: Submap) -> None:
        shape, run = self._index.prepare(submap.map), key[:2]
        places = self._index.query(shape, self._p.places, but=run)
        for other, score in self._by_run(places):
            best = max(self.score(run, other), score)
            self._best.setdefault(run, {})[other] = best
            self._best.setdefault(other, {})[run] = best
        self._index.add(key, shape, run)

    def _by_run(self, places: list[Place[Key]]) -> list[tuple[Run, float]]:
        """Return the runs that places, best first, are of, each with its best score; the first."""
        best: dict[Run, float] = {}
        for place in places:
            best.setdefault(place.key[:2], place.score)
        return list(best.items())[: self._p.runs]
