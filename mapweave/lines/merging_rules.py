"""Which segments merge, at what cost and into what direction: the rules of merging (paper, VI).

What the paper leaves open, and what we chose:

- Segments are directed, so two that are seen from opposite sides are never merged.
- The merged segment follows a main direction where that moves its ends by no more than the noise;
  an oblique wall stays oblique.
- Merging never bridges a gap or a step that can be told from noise, however cheap the rest.
"""

import numpy as np
from pydantic import Field

from mapweave.geometry.arrays import ComplexArray, FloatArray
from mapweave.lines.directions import DirectionParameters, main_directions, nearest_direction
from mapweave.lines.merging_cost import CostWeights, Pairs, cost_terms, merged_segments
from mapweave.parameters import StageParameters, derived


class MergingParameters(StageParameters):
    """Which segments are merged, and into what direction."""

    max_cost: float = Field(
        default=0.2,
        gt=0,
        description="stop when no pair is cheaper [m]; two 3 m sightings 5 cm apart cost 0.04",
    )
    max_step: float = derived(
        lambda c: 6 * c.sensor.range_sigma,
        gt=0,
        description="largest colC [m]: parallel surfaces farther apart stay apart",
    )
    max_gap: float = derived(
        lambda c: 0.5 * c.mapping.door,
        gt=0,
        description="largest proxC [m]: half of a narrow door opening",
    )
    max_angle: float = Field(
        default=np.deg2rad(60.0),
        gt=0,
        lt=np.pi / 2,
        description="largest difference of directions [rad], visible sides respected; short"
        " segments are this noisy, for long ones the cost decides",
    )
    turn_noise: float = Field(
        default=np.deg2rad(1.0),
        ge=0,
        description="of scan poses [rad]; what `max_step` grows by with the length of the shorter"
        " segment: sightings of a long wall fan out",
    )
    end_noise: float = derived(
        lambda c: 2.5 * c.sensor.range_sigma,
        ge=0,
        description="ends this close along the wall [m] are one end, seen through the noise",
    )
    direction_tolerance: float = Field(
        default=np.deg2rad(4.0),
        ge=0,
        description="a main direction within this of the average is followed [rad]…",
    )
    max_shift: float = derived(
        lambda c: 1.5 * c.sensor.range_sigma,
        ge=0,
        description="…if that moves the ends by this at most [m], the noise of a laser's returns",
    )
    balance: CostWeights = CostWeights()
    directions: DirectionParameters = DirectionParameters()


class Pairing:
    """What pairs cost and become, under the main directions of all segments (VI-A).

    Parameters
    ----------
    segments
        (n, 4) x1 y1 x2 y2 [m]: all of them, for the main directions.
    weights
        (n,) what each contributes to these [m].
    parameters
        Which are merged, and into what direction.
    """

    def __init__(
        self, segments: FloatArray, weights: FloatArray, parameters: MergingParameters
    ) -> None:
        self._directions = main_directions(segments, weights, parameters.directions)
        self._parameters = parameters

    @property
    def reach(self) -> float:
        """How far apart segments may be that are merged [m]."""
        return self._parameters.max_gap

    def direction(self, pairs: Pairs) -> ComplexArray:
        """Return the merging direction ad of each pair, (k,) unit vectors (VI)."""
        mean = pairs.mean_direction
        angle = np.angle(mean)
        main = nearest_direction(angle, self._directions, self._parameters.direction_tolerance)
        shift = pairs.lengths.max(axis=0) / 2 * np.abs(np.sin(main - angle))
        followed = shift <= self._parameters.max_shift  # never where `main` is NaN
        return np.where(followed, np.exp(1j * main), mean)

    def cost(self, pairs: Pairs) -> FloatArray:
        """Return (k,) what merging costs [m], infinite where it is out of the question."""
        limits = self._parameters
        terms = cost_terms(pairs, self.direction(pairs))
        cost = terms.total(limits.balance)
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
        """Return the (k, 4) merged segments x1 y1 x2 y2 [m], directed as the first of each pair."""
        return merged_segments(pairs, self.direction(pairs), self._parameters.end_noise)
