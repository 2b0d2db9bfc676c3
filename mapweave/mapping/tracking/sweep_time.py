"""How long a sweep takes where nobody says: a lidar that spins squeezes what it sees in turns.

Most lidars spin, and most of the cheap ones once a scan; many logs and drivers leave out how long
that takes. Taken for one instant's, a scan is squeezed while the robot turns one way and stretched
while it turns the other way, each turn comes out some percent short or long, and the map bends.

Where the robot turns, scans tell: set right for a mirror that spins once a scan they fit what is
known as well as they are, and better than set right for one that spins the other way. Scans that
are of one instant, or of a mirror that spins many times a scan, fit worse both ways.
"""

import math
from dataclasses import replace
from typing import Protocol

import numpy as np
from pydantic import Field

from mapweave.geometry import se2
from mapweave.geometry.arrays import BoolArray, FloatArray
from mapweave.mapping.tracking.observation import Observation
from mapweave.matching.icp import IcpParameters, Target, align
from mapweave.parameters import StageParameters, derived
from mapweave.scan.points import OrientedPoints
from mapweave.scan.scan import Scan

WAYS = (-1, 0, 1)  # in which a mirror may spin: as scans are, counter-clockwise is 1


class SweepParameters(StageParameters):
    """What a turn is, and what turns must tell."""

    icp: IcpParameters = derived(IcpParameters.of)
    slowest: float = Field(
        0.25, gt=0, description="[s] between scans of a mirror that spins once a scan, at most"
    )
    turn: float = Field(0.03, gt=0, description="[rad] between scans, from which squeezing shows")
    reach: float = derived(
        lambda c: 3 * c.sensor.range_sigma,
        gt=0,
        description="[m] of a surface within which a return is on it",
    )
    enough: int = Field(30, ge=2, description="turns by which it may be believed")
    most: int = Field(150, ge=2, description="turns after which nothing more is asked")
    alike: float = Field(
        1.0, ge=0, description="standard errors by which scans set right may fit worse"
    )
    better: float = Field(
        1.5, gt=0, description="standard errors by which the other way must fit worse than that"
    )
    worse: float = Field(
        4.0, gt=0, description="standard errors by which both ways fit worse: it does not spin so"
    )
    max_points: int = Field(180, ge=10, description="of a scan, in the alignment")
    prior_sigma: float = Field(0.5, gt=0, description="[m] of where it was found, in the same")
    prior_turn: float = Field(0.35, gt=0, description="[rad] the same for the turn")


class Surroundings(Protocol):
    """What scans are aligned to."""

    @property
    def target(self) -> Target:
        """It, to be aligned to."""

    def explained(self, points: OrientedPoints, poses: FloatArray, reach: float) -> BoolArray:
        """(k, n) which points lie within `reach` [m] of its surfaces at each of `poses` (k, 3)."""


class Clock(Protocol):
    """What time scans take."""

    @property
    def interval(self) -> float | None:
        """The time [s] that a scan usually takes; None where stamps do not tell."""

    def since_placed(self, scan: Scan) -> float:
        """Return how long ago [s] a scan was placed; infinite where nothing tells."""


class SweepJudge:
    """Collects what turns tell.

    Attributes
    ----------
    sweep
        [s] as of `Scan`; 0 as long as nothing is known.
    is_open
        Whether turns are still asked.
    """

    def __init__(self, parameters: SweepParameters) -> None:
        self._p = parameters
        sigma = parameters.prior_sigma, parameters.prior_sigma, parameters.prior_turn
        self._prior = np.diag(np.array(sigma) ** -2)
        self._fits: list[list[float]] = []  # of each turn: share of returns explained, by way
        self.sweep = 0.0
        self.is_open = True
        self._is_news = False

    def swept(self, scan: Scan) -> Scan:
        """Return `scan` with the sweep that was found; as it is where it says so itself."""
        if scan.sweep:
            self.is_open = False
            return scan
        return replace(scan, sweep=self.sweep) if self.sweep else scan

    def take_news(self) -> bool:
        """Whether it was found since this was asked the last time."""
        news, self._is_news = self._is_news, False
        return news

    def ask(
        self,
        seen: Observation,
        before: FloatArray,
        pose: FloatArray,
        clock: Clock,
        known: Surroundings,
    ) -> None:
        """Take in a scan, as of one instant, that was found at `pose` (3,) by what is `known`.

        Parameters
        ----------
        before
            (3,) where the scan before it was.
        """
        p, usual, since = self._p, clock.interval, clock.since_placed(seen.scan)
        if not self.is_open or usual is None or not 0 < max(usual, since) <= p.slowest:
            return
        velocity = -se2.between(pose, before) / since
        if abs(velocity[2]) * usual < p.turn:
            return
        view = float(seen.scan.angles[-1] - seen.scan.angles[0])
        once = usual * view / (2 * math.pi)
        self._fits.append([self._fit(seen, velocity, way * once, pose, known) for way in WAYS])
        self._conclude(once)

    def _fit(
        self,
        seen: Observation,
        velocity: FloatArray,
        sweep: float,
        pose: FloatArray,
        known: Surroundings,
    ) -> float:
        """Share of the returns on what is known, were they taken during a `sweep` [s]."""
        p = self._p
        points = set_right(seen.oriented, seen.scan.angles, velocity, sweep)
        thinned = points.at(slice(None, None, 1 + (len(points) - 1) // p.max_points))
        found = align(thinned, known.target, pose, p.icp, self._prior).pose
        return float(known.explained(points, found[None], p.reach).mean())

    def _conclude(self, once: float) -> None:
        """Believe that the mirror spins, or that it does not, once turns tell; or ask no more."""
        p, count = self._p, len(self._fits)
        if count < p.enough:
            return
        fits = np.array(self._fits)
        gains = [_errors(fits[:, 1 + way] - fits[:, 1]) for way in (-1, 1)]
        for way, gain in zip((-1, 1), gains, strict=True):
            against = _errors(fits[:, 1 + way] - fits[:, 1 - way])
            if gain >= -p.alike and against >= p.better:
                self.sweep, self.is_open, self._is_news = way * once, False, True
                return
        if max(gains) <= -p.worse or count >= p.most:
            self.is_open = False


def set_right(
    oriented: OrientedPoints, angles: FloatArray, velocity: FloatArray, sweep: float
) -> OrientedPoints:
    """Return points as seen at once in mid-sweep, had they been taken during a `sweep` [s].

    Parameters
    ----------
    oriented
        As if they were taken at once, sensor frame.
    angles
        (n,) of the beams, ascending [rad].
    velocity
        (3,) of the sensor, in its own frame [m/s, m/s, rad/s].
    """
    bearing = np.arctan2(oriented.points[:, 1], oriented.points[:, 0])
    share = np.mod(bearing - angles[0], 2 * math.pi) / (angles[-1] - angles[0])
    after = (share - 0.5) * sweep
    turn = velocity[2] * after
    points = _turned(oriented.points, turn) + after[:, None] * velocity[:2]
    return OrientedPoints(points, _turned(oriented.normals, turn), oriented.polyline)


def _turned(vectors: FloatArray, turn: FloatArray) -> FloatArray:
    """(n, 2) `vectors`, each turned by its `turn` (n,) [rad]."""
    c, s = np.cos(turn), np.sin(turn)
    x, y = vectors.T
    return np.column_stack([c * x - s * y, s * x + c * y])


def _errors(gains: FloatArray) -> float:
    """Mean of `gains` (n,), in its standard errors; 0 where all are 0."""
    spread = float(gains.std(ddof=1)) / math.sqrt(len(gains))
    return float(gains.mean()) / spread if spread > 0 else 0.0
