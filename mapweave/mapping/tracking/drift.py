"""Drift: how far off a robot may be by now, in directions that nothing holds.

Along bare walls a scan fits as well a step farther on, and in a round room turned about its middle.
There only the pace tells how far the robot went, and what it errs by adds up, from scan to scan,
until something holds the robot that was mapped before: it is then known where it is as surely as it
was when that was mapped.

What ICP says of a direction will not do: the normals of a wall that is round or noisy are off by
some degrees, and hundreds of them seem to hold what none of them does. So a scan is moved there,
both ways, and it is counted how many of its returns then lie on no known surface any more.
"""

import math
from collections import deque
from collections.abc import Callable
from typing import NamedTuple, Protocol, Self

import numpy as np
from pydantic import Field

from mapweave.geometry import se2
from mapweave.geometry.arrays import BoolArray, FloatArray, IntArray
from mapweave.parameters import StageParameters, derived
from mapweave.scan.points import OrientedPoints


class DriftParameters(StageParameters):
    """When a direction is open."""

    shift: float = derived(
        lambda c: 2 * c.mapping.closeness,
        gt=0,
        description="[m] by which a scan is moved, its points at the mean",
    )
    reach: float = derived(
        lambda c: 0.6 * c.mapping.closeness,
        gt=0,
        description="[m] of a surface within which a point is on it",
    )
    held: int = Field(
        5,
        ge=1,
        description="points that are then on no surface, each way, by which a direction is held;"
        " in round rooms, bare corridors and along one wall there are 4 at the most in 19 of 20"
        " scans, in recordings of offices 8 and more in as many",
    )
    held_share: float = Field(
        0.05,
        gt=0,
        lt=1,
        description="share of the points that holds it as well: of a lidar of few beams",
    )
    chance: float = Field(
        1.5,
        ge=0,
        description="sigma by which more points leave surfaces than come to lie on others, where"
        " that is no chance",
    )
    returned: float = Field(
        0.1,
        gt=0,
        lt=1,
        description="share of the points, by which what was mapped when less had drifted holds it,"
        " where it explains most of what is explained",
    )
    lately: int = Field(
        5, ge=1, description="scans, most of which must leave a direction open for it to be so"
    )
    suspicious: float = Field(
        0.1,
        gt=0,
        lt=1,
        description="directions are looked at that ICP says are held by less than this share",
    )
    lever: float = Field(3.0, gt=0, description="[m] at which a turn moves what is seen")
    mapped: int = Field(
        60,
        ge=1,
        description="times that surfaces were added, of which it is known how surely: as many as"
        " keyframes are remembered",
    )
    forgotten: float = derived(
        lambda c: 0.2 * c.mapping.closeness, gt=0, description="[m] of drift that is none"
    )


class Pace(NamedTuple):
    """What is not known of a step where nothing holds the robot: sigmas [m] and [rad]."""

    way: float
    turn: float


class _Opened(NamedTuple):
    """A scan that left a direction open: the newest point when it came, and its step."""

    newest: int
    pace: Pace


class _Mapped(NamedTuple):
    """Surfaces up to a number, where they were seen from (2,), and what had drifted by then."""

    newest: int
    at: FloatArray
    covariances: FloatArray


class Surroundings(Protocol):
    """What a scan is held by."""

    @property
    def newest(self) -> int:
        """The number of the newest point."""

    def explained(self, points: OrientedPoints, poses: FloatArray, reach: float) -> BoolArray:
        """(k, n) which points lie within `reach` [m] of surfaces, at each of `poses` (k, 3)."""

    def explaining(self, points: OrientedPoints, poses: FloatArray, reach: float) -> IntArray:
        """(k, n) the numbers of the points on surfaces that they lie at; -1 on none."""


class Drift:
    """Follows what is not known of where a robot is."""

    def __init__(self, parameters: DriftParameters) -> None:
        self._p = parameters
        self._scale = np.array([1.0, 1.0, 1.0 / parameters.lever])
        # The last surfaces, each known as surely as it was known where the robot was.
        self._mapped: deque[_Mapped] = deque(maxlen=parameters.mapped)
        self._lately: deque[_Opened | None] = deque(maxlen=parameters.lately)
        # Since its map began, and since `mark`.
        self._covariances: FloatArray = np.zeros((2, 3, 3))

    @property
    def covariance(self) -> FloatArray:
        """(3, 3) of its pose against where its map began [m², rad²], tracking frame."""
        return np.asarray(self._covariances[0])

    def copy(self) -> Self:
        """Return one that goes on by itself from here."""
        other = type(self)(self._p)
        other._mapped, other._lately = self._mapped.copy(), self._lately.copy()
        other._covariances = self._covariances
        return other

    def mark(self) -> None:
        """Note that what was mapped so far is about to be compared with what was mapped before."""
        since = np.array([1.0, 0.0])[:, None, None]
        self._covariances = since * self._covariances
        for k, each in enumerate(self._mapped):
            self._mapped[k] = each._replace(covariances=since * each.covariances)

    def end(self) -> None:
        """Forget what had drifted at the last `mark`: what was mapped before holds it."""
        self._covariances = self._covariances[[1, 1]]
        for k, each in enumerate(self._mapped):
            self._mapped[k] = each._replace(covariances=each.covariances[[1, 1]])

    def follow(
        self,
        step: FloatArray,
        pose: FloatArray,
        information: FloatArray,
        seen: OrientedPoints,
        known: Surroundings,
        pace: Callable[[], Pace],
        unsettled: float = 0.0,
    ) -> bool:
        """Go on to a scan that was found by what is `known`; return whether it drifts.

        Parameters
        ----------
        step
            (2,) from where the last one was found [m], tracking frame.
        pose
            (3,) where it was, tracking frame.
        information
            (3, 3) of `Fit`.
        seen
            Its points, sensor frame.
        pace
            What is not known of the step; asked only where nothing holds it.
        unsettled
            [m] along the direction that is held least, to where it may be as well.
        """
        if not self._mapped or self._mapped[-1].newest < known.newest:
            self._mapped.append(_Mapped(known.newest, pose[:2] - step, self._covariances))
        if self.covariance.any():
            self._covariances = _carried(self._covariances, step)
        if unsettled == 0:  # else what it is held by may be a look-alike
            self._return(pose, seen, known)
        opened = self._open(pose, information, seen, known)
        self._lately.append(_Opened(known.newest, pace()) if opened else None)
        drifts = self._drift(opened)
        if unsettled > 0:
            self._doubt(information, unsettled)
        return drifts or unsettled > 0

    def _doubt(self, information: FloatArray, unsettled: float) -> None:
        """Grow along the direction that is held least: it is here, or so far away as well [m].

        Which of both, does not depend on what it was the last time.
        """
        along = np.append(np.linalg.eigh(information[:2, :2])[1][:, 0], 0.0)
        self._covariances = self._covariances + (unsettled / 2) ** 2 * np.outer(along, along)

    def _drift(self, opened: list[FloatArray]) -> bool:
        """Grow along what is `opened`, once most of the scans lately left something open.

        One or two alone may only have seen too little that was known.
        """
        lately = [each for each in self._lately if each is not None]
        if not opened or 2 * len(lately) <= self._p.lately:
            return False
        pace, begins = lately[-1].pace, not self.covariance.any()
        if begins:
            pace = Pace(
                sum(each.pace.way for each in lately), sum(each.pace.turn for each in lately)
            )
        for direction in opened:
            self._grow(direction, pace)
        if begins:
            self._date_back(lately[0].newest)
        return True

    def _date_back(self, newest: int) -> None:
        """Note that what was mapped after a number was mapped while it drifted already."""
        for k, each in enumerate(self._mapped):
            if each.newest > newest:
                self._mapped[k] = each._replace(covariances=self._covariances)

    def _open(
        self, pose: FloatArray, information: FloatArray, seen: OrientedPoints, known: Surroundings
    ) -> list[FloatArray]:
        """Return the motions (3,) that nothing known holds `seen` against, of those suspected."""
        scale = self._scale
        strength, axes = np.linalg.eigh(scale[:, None] * information * scale)
        suspected = strength[:2] <= self._p.suspicious * strength[2]
        found = [scale * axes[:, k] for k in np.flatnonzero(suspected)]
        return [each for each in found if not self._holds(each, pose, seen, known)]

    def _holds(
        self, direction: FloatArray, pose: FloatArray, seen: OrientedPoints, known: Surroundings
    ) -> bool:
        """Whether what is `known` holds `seen` along a `direction` (3,)."""
        poses = self._aside(direction, pose, seen)
        explained = known.explained(seen, poses, self._p.reach)
        return self._missing(explained) >= self._enough(seen)

    def _enough(self, seen: OrientedPoints) -> float:
        """How many points hold a scan."""
        return min(self._p.held, self._p.held_share * len(seen))

    def _return(self, pose: FloatArray, seen: OrientedPoints, known: Surroundings) -> None:
        """Take back what has drifted along directions in which older surfaces hold `seen` again.

        It is known where the robot is as surely as it was when these were seen first. A scan among
        others that are open may be held by chance: what was mapped before all drift holds it alone.
        """
        steady = not any(self._lately)
        for direction, sigma in self._axes():
            if steady and sigma < self._p.forgotten:
                self._replace(direction, np.zeros((2, 3, 3)))
                continue
            most = sigma - self._p.forgotten if steady else 0.0
            then = self._then(direction, most, pose, seen, known)
            if then is not None:
                self._replace(direction, then)

    def _replace(self, direction: FloatArray, covariances: FloatArray) -> None:
        """Take along a `direction` (3,) what has drifted from `covariances` (2, 3, 3)."""
        along = np.outer(direction, direction / self._scale**2)
        others = np.eye(3) - along
        self._covariances = others @ self._covariances @ others.T + along @ covariances @ along.T

    def _then(
        self,
        direction: FloatArray,
        at_most: float,
        pose: FloatArray,
        seen: OrientedPoints,
        known: Surroundings,
    ) -> FloatArray | None:
        """Return the covariances (2, 3, 3) when what holds it along a `direction` (3,) was mapped.

        That is most of what explains the scan, and does so there alone, as all that is known does.
        None where nothing holds it, or more had drifted then than `at_most` [m] at the lever.
        """
        number = known.explaining(seen, self._aside(direction, pose, seen), self._p.reach)
        on_any = number >= 0
        if not on_any[0].any():
            return None
        metric = direction / self._scale**2
        then = [_carried(each.covariances, pose[:2] - each.at) for each in self._mapped]
        drifted = np.sqrt(np.maximum(metric @ np.array(then)[:, 0] @ metric, 0.0))
        mapped = np.searchsorted([each.newest for each in self._mapped], number)
        at = np.where(on_any, drifted[np.minimum(mapped, len(drifted) - 1)], np.inf)
        most = np.sort(at[0, on_any[0]])[np.count_nonzero(on_any[0]) // 2]
        if most > at_most:
            return None
        enough = max(self._enough(seen), self._p.returned * len(seen))
        if min(self._missing(at <= most), self._missing(on_any)) < enough:
            return None
        return then[int(np.flatnonzero(drifted == most)[0])]

    def _axes(self) -> list[tuple[FloatArray, float]]:
        """Return the motions (3,) along which it has drifted, and by how much [m] at the lever."""
        if not self.covariance.any():
            return []
        scale = self._scale
        squares, axes = np.linalg.eigh(self.covariance / scale[:, None] / scale)
        return [
            (scale * axes[:, k], math.sqrt(squares[k]))
            for k in range(3)
            if squares[k] > 1e-9 * squares[2]
        ]

    def _aside(self, direction: FloatArray, pose: FloatArray, seen: OrientedPoints) -> FloatArray:
        """Return (3, 3) `pose`, and those where `seen` is moved along a `direction` (3,)."""
        arms = seen.points @ se2.rotation(pose[2]).T
        moved = direction[:2] + direction[2] * np.column_stack([-arms[:, 1], arms[:, 0]])
        step = self._p.shift / math.sqrt((moved**2).sum(axis=1).mean()) * direction
        return np.array([pose, pose + step, pose - step])

    def _missing(self, explained: BoolArray) -> int:
        """Return how many fewer points are `explained` (3, n) aside than here, the less either way.

        None where that may be chance.
        """
        here, *aside = explained
        return min(_fewer(here, there, self._p.chance) for there in aside)

    def _grow(self, direction: FloatArray, pace: Pace) -> None:
        """Add what is not known of a step along a `direction` (3,).

        A pace that is off is off in the next step too: so sigmas add up, not their squares.
        """
        grown = 1.0 / math.sqrt(
            (direction[0] ** 2 + direction[1] ** 2) / pace.way**2 + direction[2] ** 2 / pace.turn**2
        )
        metric = direction / self._scale**2
        squares = np.maximum(np.einsum("i,kij,j->k", metric, self._covariances, metric), 0.0)
        more = 2 * np.sqrt(squares) / (direction @ metric) * grown + grown**2
        self._covariances = self._covariances + more[:, None, None] * np.outer(direction, direction)


def _carried(covariances: FloatArray, way: FloatArray) -> FloatArray:
    """Return (k, 3, 3) `covariances` of a pose a `way` (2,) farther on, same frame [m]."""
    moves = np.eye(3)
    moves[:2, 2] = -way[1], way[0]
    return np.asarray(moves @ covariances @ moves.T)


def _fewer(here: BoolArray, there: BoolArray, sigmas: float) -> int:
    """Return by how many fewer points are on surfaces `there` (n,) than `here`; 0 by chance.

    Of noisy points some always leave surfaces and others come to lie on them, wherever they are
    moved to: of so many changes either way the root is a sigma of their difference (McNemar's
    test). Where none come to lie on surfaces, a few that leave them are no chance.
    """
    lost, gained = np.count_nonzero(here & ~there), np.count_nonzero(there & ~here)
    fewer = int(lost - gained)
    return fewer if fewer >= sigmas * math.sqrt(lost + gained) else 0
