"""Which segments merge, at what cost and into what direction: the rules of merging (paper, VI)."""

from dataclasses import dataclass

import numpy as np

from mapweave.kernels.arrays import ComplexArray, FloatArray
from mapweave.kernels.lines.main_directions import (
    DirectionRules,
    nearest_direction,
    numpy_main_directions,
)
from mapweave.kernels.lines.merging_cost import Pairs, cost_terms, merged_segments


@dataclass(frozen=True, slots=True)
class MergingRules:
    """Plain numbers of `mapweave.lines.merging.MergingParameters`, which says what they mean.

    Attributes
    ----------
    max_cost, max_step, max_gap, end_noise, max_shift
        [m]
    max_angle, turn_noise, direction_tolerance
        [rad]
    parallelism, collinearity, proximity
        w1, w2, w3 of the cost (paper, VII).
    directions
        How main directions are found.
    """

    max_cost: float
    max_step: float
    max_gap: float
    max_angle: float
    turn_noise: float
    end_noise: float
    direction_tolerance: float
    max_shift: float
    parallelism: float
    collinearity: float
    proximity: float
    directions: DirectionRules


class Pairing:
    """What pairs cost and become, under the main directions of all segments (VI-A)."""

    def __init__(self, segments: FloatArray, weights: FloatArray, rules: MergingRules) -> None:
        self._directions = numpy_main_directions(segments, weights, rules.directions)
        self._rules = rules

    @property
    def reach(self) -> float:
        """How far apart segments may be that are merged [m]."""
        return self._rules.max_gap

    def direction(self, pairs: Pairs) -> ComplexArray:
        """Return the merging direction ad of each pair, (k,) unit vectors (VI)."""
        mean = pairs.mean_direction
        angle = np.angle(mean)
        main = nearest_direction(angle, self._directions, self._rules.direction_tolerance)
        shift = pairs.lengths.max(axis=0) / 2 * np.abs(np.sin(main - angle))
        followed = shift <= self._rules.max_shift  # never where `main` is NaN
        return np.where(followed, np.exp(1j * main), mean)

    def cost(self, pairs: Pairs) -> FloatArray:
        """Return (k,) what merging costs [m], infinite where it is out of the question."""
        limits = self._rules
        terms = cost_terms(pairs, self.direction(pairs))
        cost = terms.total(limits.parallelism, limits.collinearity, limits.proximity)
        shorter = pairs.lengths.min(axis=0)
        possible = (
            ~pairs.turned  # else they show opposite faces
            & (pairs.cosines >= np.cos(limits.max_angle))
            & (cost <= limits.max_cost)
            & (terms.collinearity <= limits.max_step + limits.turn_noise * shorter)
            & (terms.proximity <= limits.max_gap)
        )
        return np.where(possible, cost, np.inf)

    def merged(self, pairs: Pairs) -> FloatArray:
        """Return the (k, 4) merged segments."""
        return merged_segments(pairs, self.direction(pairs), self._rules.end_noise)
