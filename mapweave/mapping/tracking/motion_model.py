"""How a robot has moved lately: where it will be next, and how surprising other places are.

Robots keep their pace, and recordings are thinned by way and turn: a metre straight on, or 20° on
the spot. The turn between two scans is nearly always plain from the scans, so what is expected is
the way that went with turns like it. How well a robot keeps to that is its own: it is measured, on
the steps that what was seen determines; those along bare walls say what was expected of them.
"""

from collections import deque
from dataclasses import dataclass

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray


class MotionModelParameters(BaseModel):
    """How much of the past counts, and what a surprise costs."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    known: int = Field(60, ge=1, description="determined steps that are remembered")
    steps: int = Field(7, ge=1, description="of those, with a like turn, whose median is expected")
    enough: int = Field(3, ge=1, description="of those for a step to be expected at all")
    alike: float = Field(0.05, gt=0, description="[rad] by which like turns differ")
    alike_share: float = Field(0.3, ge=0, description="of the turn, by which they may differ more")
    held: float = Field(3.0, gt=0, description="points that hold a determined step")
    spread: float = Field(2.5, gt=0, description="sigma, in medians of what steps are off")
    min_sigma: float = Field(0.1, gt=0, description="[m] of a step against the expected one")
    faster: float = Field(
        1.5, ge=1, description="than its longest remembered step, that a robot may go unseen"
    )
    max_sigma: float = Field(
        0.5, gt=0, description="[m] as long as nothing is known, after a miss, and by odometry"
    )
    turn_sigma: float = Field(0.35, gt=0, description="[rad] of a turn against the last one")
    surprise: float = Field(
        0.02, ge=0, description="share of returns that a step e sigma² off is worth less"
    )
    turn_surprise: float = Field(0.03, ge=0, description="the same for the turn")


@dataclass(frozen=True, slots=True, eq=False)
class _Expected:
    """A step (3,) [m, m, rad] that would surprise least, and the sigma [m] of its way."""

    step: FloatArray
    sigma: float


class MotionModel:
    """Expects the next step from those before it."""

    def __init__(self, parameters: MotionModelParameters) -> None:
        self._p = parameters
        self._steps: deque[FloatArray] = deque(maxlen=parameters.known)
        self._off: deque[float] = deque(maxlen=parameters.known)
        self._last: FloatArray = se2.IDENTITY

    def copy(self) -> "MotionModel":
        """Return one that goes on by itself from here."""
        other = MotionModel(self._p)
        other._steps, other._off, other._last = self._steps.copy(), self._off.copy(), self._last
        return other

    def guesses(self, missed: int = 0, told: FloatArray | None = None) -> FloatArray:
        """Return the (k, 3) steps that are likely next [m, m, rad], the likeliest first.

        Parameters
        ----------
        missed
            Scans since the last step that was added.
        told
            (3,) by odometry, if there is any.
        """
        return np.array([e.step for e in self._expected(float(self._last[2]), missed, told)])

    def surprise(self, step: FloatArray, missed: int = 0, told: FloatArray | None = None) -> float:
        """Return how unlikely a `step` (3,) is, as a share of returns it is worth less.

        Of all that is likely the nearest counts.
        """
        return min(
            self._off_by(step, e.step, e.sigma)
            for e in self._expected(float(step[2]), missed, told)
        )

    def leap(self, step: FloatArray, missed: int = 0, told: FloatArray | None = None) -> float:
        """Return the surprise of a `step` for a robot that does not keep to its pace."""
        return min(
            self._off_by(step, e.step, self._p.max_sigma)
            for e in self._expected(float(step[2]), missed, told)
        )

    def way(self, turn: float) -> tuple[FloatArray, float]:
        """Return (2,) the way [m] that is expected with `turn` [rad], and its sigma [m]."""
        p = self._p
        alike = self._alike(turn)
        if len(alike) < p.enough:
            return self._last[:2], p.max_sigma
        sigma = p.spread * float(np.median(self._off)) if len(self._off) > p.steps else p.max_sigma
        return np.median(alike, axis=0), float(np.clip(sigma, p.min_sigma, p.max_sigma))

    def reach(self, steps: int) -> float:
        """Return how far [m] a robot comes in so many steps, were each as long as its longest."""
        p = self._p
        longest = max((float(np.hypot(*step[:2])) for step in self._steps), default=np.inf)
        return steps * p.faster * longest + p.max_sigma

    def add(self, step: FloatArray, information: FloatArray) -> None:
        """Take a step (3,), and the (3, 3) information that held it, in units of one point."""
        if np.linalg.eigvalsh(information[:2, :2])[0] >= self._p.held:
            if len(self._alike(step[2])) >= self._p.enough:
                self._off.append(float(np.hypot(*(step[:2] - self.way(step[2])[0]))))
            self._steps.append(step)
        self._last = step

    def _alike(self, turn: float) -> list[FloatArray]:
        """(k, 2) ways that went with turns alike, the latest; to the other side counts as well."""
        p = self._p
        apart = max(p.alike, p.alike_share * abs(turn))
        found: list[FloatArray] = []
        for x, y, turned in reversed(self._steps):
            if len(found) == p.steps:
                break
            if abs(turned - turn) <= apart:
                found.append(np.array([x, y]))
            elif abs(turned + turn) <= apart:
                found.append(np.array([x, -y]))
        return found

    def _expected(self, turn: float, missed: int, told: FloatArray | None) -> list[_Expected]:
        """Return what is likely if the robot turns by `turn` [rad]."""
        p, last = self._p, float(self._last[2])
        if missed:  # it went on at its pace, or stopped, which is why scans were missed
            straight = np.append(self.way(0.0)[0], 0.0)
            gone = np.append(self.way(last)[0], last)
            for _ in range(missed):
                gone = se2.compose(gone, straight)
            found = [_Expected(gone, p.max_sigma), _Expected(se2.IDENTITY, p.max_sigma)]
        else:
            way, sigma = self.way(turn)
            found = [_Expected(np.append(way, last), sigma)]
        return found if told is None else [_Expected(told, p.max_sigma), *found]

    def _off_by(self, step: FloatArray, expected: FloatArray, sigma: float) -> float:
        """Heavy-tailed: robots do turn on the spot between two scans, only not often."""
        p = self._p
        x, y, turn = step - expected
        moved = p.surprise * np.log1p((x * x + y * y) / sigma**2)
        turned = p.turn_surprise * np.log1p((float(se2.wrap(turn)) / p.turn_sigma) ** 2)
        return float(moved + turned)
