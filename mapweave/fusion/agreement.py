"""When two alignments of the same maps, found at different places, are the same."""

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray


class AgreementParameters(BaseModel):
    """By how much they may differ."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    distance: float = Field(1.0, gt=0, description="[m] by which two alignments may differ")
    turn: float = Field(0.09, gt=0, description="[rad] by which they may differ: 5°")


def difference(one: FloatArray, other: FloatArray, middle: FloatArray) -> tuple[float, float]:
    """By how much two transforms (3,) differ at `middle` (2,) [m], [rad]."""
    apart = se2.transform_points(one, middle) - se2.transform_points(other, middle)
    return float(np.hypot(*apart)), float(abs(se2.wrap(one[2] - other[2])))
