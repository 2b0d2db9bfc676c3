"""Alignment of many hypotheses at once, by look-up in a raster (paper, VIII, V1).

The same steps as `icp.align_all`, coarser and without a tree: a sample's partner is the
wall nearest to its cell, whichever way that faces, and pulls only where both face the same way.
What survives is aligned once more, by `icp.align_all`.
"""

from functools import lru_cache

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from mapweave.geometry.arrays import FloatArray
from mapweave.kernels.matching import raster_icp as kernel
from mapweave.matching.distance_field import DistanceField


class FieldIcpParameters(BaseModel):
    """How far samples pull and for how long."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    max_samples: int = Field(150, ge=10, description="of the moving map's walls")
    start_scale: float = Field(
        0.5, gt=0, description="[m] residual at which a pair's weight is a quarter, first iteration"
    )
    end_scale: float = Field(0.15, gt=0, description="[m] the same at the end: above a cell")
    iterations: int = Field(8, ge=1, description="the scale shrinks evenly over them")
    min_cosine: float = Field(0.7, ge=0, le=1, description="of the normals of a pair: 45°")
    damping: float = Field(
        0.01, gt=0, description="share of the samples that holds what the walls leave open"
    )


def align_on_raster(
    reference: DistanceField,
    other: DistanceField,
    transforms: FloatArray,
    parameters: FieldIcpParameters,
) -> FloatArray:
    """Return (k, 3) `transforms` moved until the walls of `other` lie on those of `reference`."""
    p = parameters
    walls = reference.oriented
    return kernel.align_on_raster(
        *(other.oriented.points, other.oriented.normals),
        p.max_samples,
        *(transforms, _scales(p), walls.points, walls.normals),
        reference.nearest,
        reference.origin,
        *(reference.cell, p.min_cosine, p.damping),
    )


@lru_cache(16)
def _scales(p: FieldIcpParameters) -> FloatArray:
    """(iterations,) [m] residuals at which a pair's weight is a quarter."""
    return np.geomspace(p.start_scale, p.end_scale, p.iterations)
