"""Hypotheses: rigid transforms that the shapes of two maps propose (paper, VIII, H1 and H2).

Salient windows of polylines and corners of walls each propose transforms; all proposals are
scored at once by what both maps saw, and the best that clearly differ are handed on.
"""

from dataclasses import dataclass

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from mapweave import se2
from mapweave.arrays import FloatArray
from mapweave.corners import CornerParameters, Corners, find_corners, propose
from mapweave.map_raster import MapRaster, RasterParameters
from mapweave.maps import LineMap
from mapweave.shape_windows import WindowParameters, Windows, all_windows, match_all
from mapweave.verification import VerificationParameters, coarse_scores


class HypothesisParameters(BaseModel):
    """What proposes, and how many proposals survive."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    windows: WindowParameters = WindowParameters()
    corners: CornerParameters = CornerParameters()
    max_samples: int = Field(250, ge=10, description="of a map's walls, in the scoring of all")
    distance: float = Field(1.0, gt=0, description="[m] between different hypotheses (design)")
    turn: float = Field(0.157, gt=0, description="[rad] between different hypotheses: 9° (design)")
    count: int = Field(25, ge=2, description="handed on")


@dataclass(frozen=True, slots=True, eq=False)
class Shape:
    """A line map with what comparing it takes; made once for each map."""

    lines: LineMap
    raster: MapRaster
    windows: tuple[Windows, ...]
    corners: Corners

    @classmethod
    def of(
        cls, lines: LineMap, hypotheses: HypothesisParameters, raster: RasterParameters
    ) -> "Shape":
        """Prepare `lines`, which have at least one segment."""
        return cls(
            lines,
            MapRaster.of(lines, raster),
            all_windows(lines.segments, lines.polyline, hypotheses.windows),
            find_corners(lines.segments, hypotheses.corners),
        )


def hypothesise(
    reference: Shape,
    other: Shape,
    parameters: HypothesisParameters,
    verification: VerificationParameters,
) -> tuple[FloatArray, FloatArray]:
    """Return (k, 3) transforms from `other` to `reference`, and their (k,) coarse scores [m].

    Best first; any two differ by more than `parameters.distance` or `parameters.turn`, measured
    at the middle of `other`.
    """
    similar = match_all(reference.windows, other.windows, parameters.windows)
    cornered = propose(reference.corners, other.corners, parameters.corners)
    proposals = np.vstack([similar.transform, cornered])
    scores = coarse_scores(
        reference.raster, other.raster, proposals, parameters.max_samples, verification
    )
    middle = other.raster.surface.points.mean(axis=0)
    kept = different(proposals, scores, middle, parameters)
    return proposals[kept], scores[kept]


def different(
    transforms: FloatArray, scores: FloatArray, middle: FloatArray, p: HypothesisParameters
) -> list[int]:
    """Return indices of the best of (n, 3) `transforms`, each different from the better ones."""
    c, s = np.cos(transforms[:, 2]), np.sin(transforms[:, 2])
    place = transforms[:, :2] + np.column_stack(
        [c * middle[0] - s * middle[1], s * middle[0] + c * middle[1]]
    )
    left = np.ones(len(transforms), dtype=np.bool_)
    kept: list[int] = []
    for index in np.argsort(-scores, kind="stable"):
        if not left[index]:
            continue
        kept.append(int(index))
        if len(kept) == p.count:
            break
        apart = np.hypot(*(place - place[index]).T)
        turned = np.abs(se2.wrap(transforms[:, 2] - transforms[index, 2]))
        left &= (apart > p.distance) | (turned > p.turn)
    return kept
