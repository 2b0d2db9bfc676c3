"""How a robot has moved lately: where it will be next, and how surprising other places are.

Robots keep their pace, and recordings are thinned by way and turn: a metre straight on, or 20° on
the spot. The turn between two scans is nearly always plain from the scans, so what is expected is
the way that went with turns like it. How well a robot keeps to that is its own: it is measured, on
the steps that what was seen determines; those along bare walls say what was expected of them.
"""

import math
from collections import deque
from statistics import median
from typing import NamedTuple

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.geometry.ellipses import ellipse


class MotionModelParameters(BaseModel):
    """How much of the past counts, and what a surprise costs."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    known: int = Field(60, ge=1, description="determined steps that are remembered")
    steps: int = Field(7, ge=1, description="of those, with a like turn, whose median is expected")
    enough: int = Field(3, ge=1, description="of those for a step to be expected at all")
    paced: int = Field(
        20, ge=1, description="of those from which its longest step bounds a robot without a clock"
    )
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
    turn_sigma: float = Field(
        0.35, gt=0, description="[rad] of a turn against the last one, at the least"
    )
    unsure: float = Field(
        0.5, gt=0, description="of its usual step, by which a robot's may be off all the time"
    )
    uneven: float = Field(
        0.5, gt=0, description="of its usual step, by which any robot's may differ at the least"
    )
    surprise: float = Field(
        0.02, ge=0, description="share of returns that a step e sigma² off is worth less"
    )
    turn_surprise: float = Field(0.03, ge=0, description="the same for the turn")


class _Expected(NamedTuple):
    """A step that would surprise least [m, m, rad], and the sigma [m] of its way."""

    x: float
    y: float
    turn: float
    sigma: float


class MotionModel:
    """Expects the next step from those before it.

    It is asked several times a scan about a handful of numbers: plain floats, no arrays.
    """

    def __init__(self, parameters: MotionModelParameters) -> None:
        self._p = parameters
        self._steps: deque[tuple[float, float, float]] = deque(maxlen=parameters.known)
        self._lengths: deque[float] = deque(maxlen=parameters.known)  # [m] of these
        self._usual: dict[float, tuple[float, float] | None] = {}  # what was asked since the last
        self._off: deque[float] = deque(maxlen=parameters.known)
        self._sigma = parameters.max_sigma  # [m] of a step with a turn that is known
        self._turns: deque[float] = deque(maxlen=parameters.known)  # [rad] from one to the next
        self._turn_sigma = parameters.turn_sigma
        self._any_sigma = parameters.max_sigma  # [m] of a step of any robot with steps as long
        self._last = (0.0, 0.0, 0.0)

    def copy(self) -> "MotionModel":
        """Return one that goes on by itself from here."""
        other = MotionModel(self._p)
        other._steps, other._off = self._steps.copy(), self._off.copy()
        other._lengths = self._lengths.copy()
        other._sigma, other._last = self._sigma, self._last
        other._turns = self._turns.copy()
        other._turn_sigma, other._any_sigma = self._turn_sigma, self._any_sigma
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
        return np.array([e[:3] for e in self._expected(self._last[2], missed, told)])

    def judge(
        self, step: FloatArray, missed: int = 0, told: FloatArray | None = None
    ) -> tuple[float, float]:
        """Return how unlikely a `step` (3,) is for this robot, and for any: surprise and leap.

        Both are shares of returns that it is worth less. Of all that is likely the nearest counts.
        A leap is the surprise for a robot that does not keep to its pace.
        """
        x, y, turn = step.tolist()
        expected = self._expected(turn, missed, told)
        surprise = min(self._off_by(x, y, turn, e, e.sigma) for e in expected)
        leap = min(self._off_by(x, y, turn, e, self._any_sigma) for e in expected)
        return surprise, leap

    def surprise(self, step: FloatArray, missed: int = 0, told: FloatArray | None = None) -> float:
        """Return how unlikely a `step` (3,) is for this robot; see `judge`."""
        return self.judge(step, missed, told)[0]

    def leap(self, step: FloatArray, missed: int = 0, told: FloatArray | None = None) -> float:
        """Return how unlikely a `step` (3,) is for any robot; see `judge`."""
        return self.judge(step, missed, told)[1]

    def way(self, turn: float) -> tuple[float, float, float]:
        """Return the way x, y [m] that is expected with `turn` [rad], and its sigma [m]."""
        usual = self._usual_way(turn)
        if usual is None:
            return self._last[0], self._last[1], self._p.max_sigma
        return *usual, self._sigma

    def unknown(self, turn: float) -> tuple[float, float]:
        """Return what is not known of a step with `turn` [rad] that nothing holds: [m], [rad].

        It is more than steps differ by: a robot that stops is wrongly expected again and again.
        Nor is one held still that jitters where hardly anything holds it: what is usual of late is
        no less uncertain than what was usual with such a turn. With a turn that is new to it, it
        goes no farther than with any other.
        """
        p, alike = self._p, self._alike(turn, self._p.known)
        if len(alike) < p.enough:
            known = len(self._lengths) >= p.enough
            way = p.unsure * max(self._lengths) if known else p.max_sigma
            return way, self._turn_sigma
        lengths = [math.hypot(x, y) for x, y in alike]
        return p.unsure * max(median(lengths), median(lengths[: p.steps])), self._turn_sigma

    @property
    def is_paced(self) -> bool:
        """Whether enough steps were determined to say how far it goes in one, at the most."""
        return len(self._steps) >= self._p.paced

    def reach(self, steps: float) -> float:
        """Return how far [m] a robot comes in so many steps, were each as long as its longest."""
        p = self._p
        return steps * p.faster * max(self._lengths, default=math.inf) + p.max_sigma

    def add(self, step: FloatArray, information: FloatArray) -> None:
        """Take a step (3,), and the (3, 3) information that held it, in units of one point."""
        x, y, turn = step.tolist()
        if ellipse(information).least >= self._p.held:
            usual = self._usual_way(turn)
            if usual is not None:
                self._off.append(math.hypot(x - usual[0], y - usual[1]))
                if len(self._off) > self._p.steps:
                    sigma = self._p.spread * median(self._off)
                    self._sigma = min(max(sigma, self._p.min_sigma), self._any_sigma)
            self._steps.append((x, y, turn))
            self._lengths.append(math.hypot(x, y))
            self._turns.append(abs(math.remainder(turn - self._last[2], 2 * math.pi)))
            self._measure()
            self._usual = {}
        self._last = (x, y, turn)

    def _measure(self) -> None:
        """Measure how its turns differ, and what is much for steps as long as its own.

        One that says where it is every 2 m has turned by any angle meanwhile.
        """
        p = self._p
        if len(self._turns) <= p.steps:
            return
        self._turn_sigma = max(p.turn_sigma, p.spread * median(self._turns))
        self._any_sigma = max(p.max_sigma, p.uneven * median(self._lengths))

    def _usual_way(self, turn: float) -> tuple[float, float] | None:
        """Return the median way [m] that went with turns like `turn` [rad]; None of too few."""
        if turn not in self._usual:
            alike, found = self._alike(turn, self._p.steps), None
            if len(alike) >= self._p.enough:
                found = median(x for x, _ in alike), median(y for _, y in alike)
            self._usual[turn] = found
        return self._usual[turn]

    def _alike(self, turn: float, most: int) -> list[tuple[float, float]]:
        """At `most` so many ways that went with turns alike, the latest first.

        To the other side counts as well.
        """
        p = self._p
        apart = max(p.alike, p.alike_share * abs(turn))
        low, high = turn - apart, turn + apart
        found: list[tuple[float, float]] = []
        for x, y, turned in reversed(self._steps):
            if low <= turned <= high:
                found.append((x, y))
            elif low <= -turned <= high:
                found.append((x, -y))
            else:
                continue
            if len(found) == most:
                break
        return found

    def _expected(self, turn: float, missed: int, told: FloatArray | None) -> list[_Expected]:
        """Return what is likely if the robot turns by `turn` [rad]."""
        p, last = self._p, self._last[2]
        if missed:  # it went on at its pace, or stopped, which is why scans were missed
            straight = np.array([*self.way(0.0)[:2], 0.0])
            gone = np.array([*self.way(last)[:2], last])
            for _ in range(missed):
                gone = se2.compose(gone, straight)
            found = [_step(gone, self._any_sigma), _step(se2.IDENTITY, self._any_sigma)]
        else:
            x, y, sigma = self.way(turn)
            found = [_Expected(x, y, last, sigma)]
        return found if told is None else [_step(told, p.max_sigma), *found]

    def _off_by(self, x: float, y: float, turn: float, expected: _Expected, sigma: float) -> float:
        """Heavy-tailed: robots do turn on the spot between two scans, only not often."""
        p = self._p
        dx, dy = x - expected.x, y - expected.y
        turned = math.remainder(turn - expected.turn, 2 * math.pi) / self._turn_sigma
        moved = math.log1p((dx * dx + dy * dy) / sigma**2)
        return p.surprise * moved + p.turn_surprise * math.log1p(turned * turned)


def _step(step: FloatArray, sigma: float) -> _Expected:
    x, y, turn = step.tolist()
    return _Expected(x, y, turn, sigma)
