"""How segments are chosen for merging: the parameters of its rules (paper, VI).

What the paper leaves open, and what we chose:

- Segments are directed, so two that are seen from opposite sides are never merged.
- The merged segment follows a main direction where that moves its ends by no more than the noise;
  an oblique wall stays oblique.
- Merging never bridges a gap or a step that can be told from noise, however cheap the rest.
"""

import numpy as np
from pydantic import Field

from mapweave.kernels.lines.merging_rules import MergingRules
from mapweave.lines.directions import DirectionParameters
from mapweave.lines.merging_cost import CostWeights
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

    @property
    def rules(self) -> MergingRules:
        """The same as plain numbers."""
        return MergingRules(
            max_cost=self.max_cost,
            max_step=self.max_step,
            max_gap=self.max_gap,
            max_angle=self.max_angle,
            turn_noise=self.turn_noise,
            end_noise=self.end_noise,
            direction_tolerance=self.direction_tolerance,
            max_shift=self.max_shift,
            parallelism=self.balance.parallelism,
            collinearity=self.balance.collinearity,
            proximity=self.balance.proximity,
            directions=self.directions.rules,
        )
