"""Localisation: a robot that is set down in a known map finds itself there, and only follows.

It is tracked from scan to scan as a mapper tracks it, in a frame of its own. What it saw over the
last metres is looked for in the known map, twice in a row; from then on it is looked for there
again and again, about where the robot is believed to be, so that no drift adds up.
"""

from collections.abc import Callable
from dataclasses import replace
from itertools import groupby
from typing import NamedTuple

import numpy as np
from pydantic import Field

from mapweave.config import Config
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.mapping.backend import FinishedSubmap
from mapweave.mapping.localization.known_map import KnownMap
from mapweave.mapping.localization.place_finder import (
    Place,
    PlaceFinder,
    PlaceFinderParameters,
    PlaceSearcher,
    Search,
)
from mapweave.mapping.localization.recent_scans import Recollection
from mapweave.mapping.mapper import Mapper, MapperParameters
from mapweave.mapping.placement import Placement
from mapweave.mapping.tracking.pose_covariance import turn_uncertainty
from mapweave.maps import LineMap, MadeWith, RobotMap, Submap, Trajectory
from mapweave.parameters import StageParameters, derived
from mapweave.scan.scan import Scan


class LocalizerParameters(StageParameters):
    """One model for each stage, and when a place is looked for."""

    mapper: MapperParameters = derived(MapperParameters.of)
    finder: PlaceFinderParameters = derived(PlaceFinderParameters.of)
    every: int = Field(
        2,
        ge=1,
        description="kept scans from one search to the next once the place is known, and at the"
        " least between two that find the same place: some 0.6 m of path",
    )
    looked_back: int = Field(
        14, ge=2, description="kept scans that are looked for once the place is known: some 4 m"
    )
    agreement: float = Field(0.5, gt=0, description="[m] within which two searches agree")
    agreed_turn: float = Field(0.09, gt=0, description="[rad] likewise: 5°")
    patience: int = Field(
        5, ge=1, description="searches in a row that did not confirm a place before it is given up"
    )


class _Step(NamedTuple):
    """A scan's index, stamp [s], pose (3,) and (4,) uncertainty, in the tracker's frame."""

    number: int
    stamp: float
    pose: FloatArray
    uncertainty: FloatArray


class _Located(NamedTuple):
    """The same in a component of the known map."""

    component: int
    step: _Step


class _TrackedOnly:
    """A `BackendRunner` that leaves submaps as they were tracked: the known map corrects them."""

    is_ready = True

    def begin(self, finished: FinishedSubmap) -> None:
        """Nothing is settled."""

    def take(self) -> None:
        """There is no outcome."""


class Localizer:
    """Follows one robot through a known map, scan by scan; it adds nothing to that map.

    Parameters
    ----------
    known
        The map.
    robot, boot, config, live, on_warning
        As of `Mapper`.
    searcher
        Looks for places; by default here, which takes some 0.1 s each time.
    on_news
        Told in words when the robot has found itself, when it no longer knows where it is, and
        when nothing that it recalls is found.
    """

    def __init__(
        self,
        known: KnownMap,
        robot: str = "r1",
        boot: str = "0",
        config: Config | None = None,
        searcher: PlaceSearcher | None = None,
        *,
        live: bool = False,
        on_warning: Callable[[str], None] | None = None,
        on_news: Callable[[str], None] = lambda _: None,
    ) -> None:
        config = Config() if config is None else config
        self.parameters = LocalizerParameters.of(config)
        self._known = known
        self._mapper = Mapper(
            robot,
            boot,
            self.parameters.mapper,
            _TrackedOnly(),
            config,
            live=live,
            prompt=True,  # a scan is on the path where it was placed when it came
            on_warning=on_warning,
        )
        self._live = live
        self._tell = on_news
        self._made_with = MadeWith.of(config)
        self._searcher = searcher or PlaceFinder(known, self.parameters.finder)
        self._searching: Search | None = None
        self._outdated = False  # whether the robot lost itself since that search began
        self._recollection = Recollection(self.parameters.finder.recent)
        self._place: Place | None = None
        self._candidate: tuple[Place, int] | None = None  # found once, at which kept scan
        self._unconfirmed = 0  # searches in a row that did not find the place again
        self._is_missed = False  # told that nothing is found
        self._waiting: list[_Step] = []  # tracked since track was lost, and not yet located
        self._path: list[_Located] = []

    @property
    def robot(self) -> str:
        """The robot's id."""
        return self._mapper.robot

    @property
    def boot(self) -> str:
        """Which run of it this is."""
        return self._mapper.boot

    @property
    def followed(self) -> RobotMap:
        """The known map, under this robot's name; the first submaps of `robot_map` are its."""
        known = self._known
        return RobotMap(self.robot, self.boot, 0, known.submaps, self._made_with, known.marks)

    @property
    def place(self) -> Place | None:
        """Where the tracker's frame is in the known map; None where the robot is not located."""
        return self._place

    def add(self, scan: Scan) -> Placement:
        """Take the next scan; errors as of `Mapper.add`.

        Returns
        -------
        Placement
            In the known map: a scan is placed once the robot is located in it.
        """
        tracked = self._mapper.add(scan)
        if tracked.lost:
            self._lose()
        seen = self._mapper.seen
        if seen is None or tracked.pose is None or tracked.uncertainty is None:
            return Placement(False, self._component, False, False)
        kept = self._recollection.add(seen, tracked.pose)
        every = 1 if self._place is None else self.parameters.every
        if kept and self._recollection.count % every == 0:
            self._take_outcome()
            self._search()
        return self._placed(_Step(seen.scan.index, scan.stamp, tracked.pose, tracked.uncertainty))

    def finish(self) -> RobotMap:
        """Return the known map, and the path in it."""
        self._mapper.finish()
        if self._searching is not None:
            self._adopt(self._searcher.take())
        return self.robot_map()

    def robot_map(self) -> RobotMap:
        """Return the known map, and the path in it so far."""
        known, submaps = self.followed, [*self._known.submaps]
        length = self.parameters.mapper.backend.submap.max_scans
        for component, steps in groupby(self._path, lambda each: each.component):
            located = [each.step for each in steps]
            for k in range(0, len(located), length):
                submaps.append(_path(len(submaps), component, located[k : k + length]))
        return replace(known, version=len(self._path), submaps=tuple(submaps))

    def snapshot(self) -> "LocalizedMap":
        """Return what `robot_map` would return now: it is drawn in a moment."""
        return LocalizedMap(self.robot_map())

    @property
    def _component(self) -> int:
        return 0 if self._place is None else self._place.component

    def _placed(self, step: _Step) -> Placement:
        """Note where a scan is, if that is known."""
        if self._place is None:
            self._waiting.append(step)
            return Placement(False, 0, False, False)
        located = _located(step, self._place)
        self._path.append(located)
        return Placement(
            True, located.component, False, False, located.step.pose, located.step.uncertainty
        )

    def _search(self) -> None:
        """Look for what was seen lately: anywhere, or where it should be."""
        if self._searching is not None or self._recollection.count == 0:
            return
        looked_back = self.parameters.finder.recent.kept
        if self._place is not None:
            looked_back = self.parameters.looked_back
        self._searching = Search(self._recollection.last(looked_back), self._place)
        self._searcher.begin(self._searching)

    def _take_outcome(self) -> None:
        """Take in what the search under way has found; a live robot does not wait for it."""
        if self._searching is None or (self._live and not self._searcher.is_ready):
            return
        self._adopt(self._searcher.take())

    def _adopt(self, found: Place | None) -> None:
        """Believe what was found twice; give up what was not found again and again."""
        search, self._searching = self._searching, None
        outdated, self._outdated = self._outdated, False
        if search is None or outdated:
            return
        if search.near is None:
            self._settle(found, search.recent.pose)
            return
        if found is not None:
            self._place, self._unconfirmed = found, 0
            return
        self._unconfirmed += 1
        if self._unconfirmed >= self.parameters.patience:
            self._lose()

    def _settle(self, found: Place | None, pose: FloatArray) -> None:
        """Be where the robot was found now and earlier on, at `pose` (3,) tracker's frame."""
        p, now = self.parameters, self._recollection.count
        if found is None:
            self._candidate = None
            self._tell_missed(now)
            return
        before, since = self._candidate or (found, now)
        if found.differs(before, pose, p.agreement, p.agreed_turn):
            before, since = found, now
        self._candidate = before, since
        if now - since < p.every:
            return
        self._place, self._candidate, self._unconfirmed = found, None, 0
        self._is_missed = False
        self._tell(f"the robot has found itself in component {found.component} of the map")
        self._path += [_located(step, found) for step in self._waiting]
        self._waiting = []

    def _tell_missed(self, kept: int) -> None:
        """Say once that a drive as long as is recalled, of `kept` scans, was found nowhere."""
        if self._is_missed or kept < self.parameters.finder.recent.kept:
            return
        self._is_missed = True
        self._tell(
            "nothing that the robot saw is found in the map: it is of another place, or that has"
            " changed; the robot has no pose until it is where the map shows"
        )

    def _lose(self) -> None:
        """Forget where the robot is: it may be anywhere."""
        if self._place is not None:
            self._tell("the robot no longer knows where in the map it is")
        self._place, self._candidate, self._unconfirmed = None, None, 0
        self._outdated = self._searching is not None
        self._waiting = []
        self._recollection.clear()


class LocalizedMap(NamedTuple):
    """A known map and the path in it, at one moment."""

    map: RobotMap

    @property
    def submaps(self) -> tuple[Submap, ...]:
        """All submaps where they are."""
        return self.map.submaps

    def robot_map(self) -> RobotMap:
        """Return it."""
        return self.map


def _located(step: _Step, place: Place) -> _Located:
    """Return a tracked step where it is in the known map."""
    pose = se2.compose(place.transform, step.pose)
    held = turn_uncertainty(step.uncertainty, place.transform[2])
    return _Located(place.component, step._replace(pose=pose, uncertainty=held))


def _path(number: int, component: int, steps: list[_Step]) -> Submap:
    """Return a stretch of the path as a submap without walls, in the component's own frame."""
    trajectory = Trajectory(
        np.array([step.number for step in steps], dtype=np.int64),
        np.array([step.stamp for step in steps]),
        np.array([step.pose for step in steps]).reshape(-1, 3),
        np.array([step.uncertainty for step in steps]).reshape(-1, 4),
    )
    return Submap(number, component, np.zeros(3), LineMap.empty(), trajectory)
