"""Verification: what two maps say of a transform between them (paper, VIII, V2, and beyond).

The paper confirms an alignment when parts of both maps are close in the Hausdorff sense and one
of their polylines is complex enough. Look-alike places pass that test, so free space votes too:
wall of one map where the other saw through is a contradiction.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from pydantic import Field

from mapweave.geometry.arrays import BoolArray, Float32Array, FloatArray
from mapweave.kernels.matching.judging import Limits, Weighed, WeighedMap, judge_samples, weigh_maps
from mapweave.kernels.matching.rasters import Codes, cell_codes
from mapweave.kernels.scores import ScoredMap, mutual_scores
from mapweave.maps import LineMap
from mapweave.matching.distance_field import DistanceField
from mapweave.matching.free_standing import free_standing
from mapweave.parameters import StageParameters, derived
from mapweave.shape.tangent_space import complexities

DIRECTIONS = 64  # that coarse scores tell apart: 5.6° each
NOTHING, SEEN_THROUGH = DIRECTIONS, DIRECTIONS + 1  # what a cell without a wall says


class VerificationParameters(StageParameters):
    """When walls coincide and when they contradict."""

    closeness: float = derived(
        lambda c: c.mapping.closeness,
        gt=0,
        description="[m] Hausdorff distance below which walls coincide",
    )
    min_cosine: float = Field(
        0.8, gt=0, le=1, description="of the angle between normals of coinciding walls: 37°"
    )
    clearance: float = derived(
        lambda c: c.mapping.clearance,
        gt=0,
        description="[m] inside seen free space from which a wall contradicts; covers"
        " what two maps are bent against each other",
    )
    contradiction_weight: float = Field(
        1.0, gt=0, description="metres in common that a metre contradicted outweighs"
    )
    moved_weight: float = Field(
        1.0, gt=0, le=1, description="metres contradicted that a metre of what may be moved counts"
    )
    moved_gap: float = Field(
        0.3, gt=0, description="[m] to all other wall, that what may be moved keeps at least"
    )
    moved_side: float = Field(
        1.1, gt=0, description="[m] of the longer side of what may be moved, between samples"
    )
    shared_part: float = Field(
        0.5, gt=0, le=1, description="share of a segment that coincides, to count as shared"
    )


class Tally(NamedTuple):
    """[m] of wall in both maps, the smaller of the two, and of wall that the other saw through."""

    common: float
    contradicted: float


@dataclass(frozen=True, slots=True, eq=False)
class Verdict:
    """What speaks for and against one transform.

    Attributes
    ----------
    common
        [m] of wall in both maps: the smaller of the two counts.
    contradicted
        [m] of wall, of both maps, that the other saw through; what may have been moved counts less.
    overlap
        Share of the wall of either map that lies where the other looked and that coincides.
    residual
        [m] median distance of coinciding walls.
    held
        [m] of common wall that hold the least held direction.
    """

    common: float
    contradicted: float
    overlap: float
    residual: float
    held: float
    contradiction_weight: float

    @property
    def score(self) -> float:
        """[m] of wall in common less wall contradicted."""
        return self.common - self.contradiction_weight * self.contradicted


def coarse_scores(
    reference: DistanceField,
    other: DistanceField,
    transforms: FloatArray,
    max_samples: int,
    parameters: VerificationParameters,
) -> FloatArray:
    """Return (k,) metres in common less contradicted for (k, 3) `transforms`, from few samples."""
    ours, theirs = _scored(reference, parameters), _scored(other, parameters)
    worth = _worth(parameters.min_cosine, parameters.contradiction_weight)
    return mutual_scores(ours, theirs, transforms, max_samples, worth)


def _scored(raster: DistanceField, p: VerificationParameters) -> ScoredMap:
    """Return what scores are looked up by."""
    samples = raster.oriented.points, raster.facing, raster.weight, worth_of_missing(raster, p)
    return ScoredMap(*samples, raster.origin, raster.cell, _codes(raster, p))


def _codes(raster: DistanceField, p: VerificationParameters) -> Codes:
    """(rows, columns) what each cell says: a row of `_worth`; made once."""
    limits = p.closeness, p.clearance
    if limits not in raster.codes:
        codes = said_by_cells(raster, *limits)
        for rim in (codes[0], codes[-1], codes[:, 0], codes[:, -1]):
            rim[:] = NOTHING  # it stands for all that lies beyond it
        raster.codes[limits] = codes
    return raster.codes[limits]


def said_by_cells(raster: DistanceField, closeness: float, clearance: float) -> Codes:
    """(rows, columns) which of DIRECTIONS the wall near each cell faces, or what else it says.

    SEEN_THROUGH where space is free by more than `clearance` [m], else NOTHING.
    """
    cells = raster.nearest, raster.distance, raster.depth, raster.facing
    return cell_codes(*cells, closeness, clearance, DIRECTIONS)


@lru_cache(16)
def _worth(min_cosine: float, contradiction_weight: float) -> Float32Array:
    """(codes, directions) what a metre of wall counts, by the cell's code and the wall's direction.

    Below 0 where it is seen through, and is missing.
    """
    turn = 2 * np.pi / DIRECTIONS * np.arange(DIRECTIONS)
    worth: Float32Array = np.zeros((SEEN_THROUGH + 1, DIRECTIONS), dtype=np.float32)
    worth[:DIRECTIONS] = np.cos(turn[:, None] - turn) > min_cosine
    worth[SEEN_THROUGH] = -contradiction_weight
    return worth


def verify(
    reference: DistanceField,
    other: DistanceField,
    transform: FloatArray,
    parameters: VerificationParameters,
) -> Verdict:
    """Return what both maps say of `transform` (3,) from `other` to `reference`."""
    forward, backward = _both_ways(reference, other, transform, parameters)
    common, contradicted = _tallied(forward, backward)
    return Verdict(
        common,
        contradicted,
        common / max(common + contradicted, 1e-9),
        forward.residual,
        forward.held,
        parameters.contradiction_weight,
    )


def tally(
    reference: DistanceField,
    other: DistanceField,
    transform: FloatArray,
    parameters: VerificationParameters,
) -> Tally:
    """Return the wall in common and contradicted, as `verify` does, and nothing else: sooner."""
    return _tallied(*_both_ways(reference, other, transform, parameters))


def shared_complexity(
    reference: DistanceField,
    other: DistanceField,
    transform: FloatArray,
    lines: LineMap,
    parameters: VerificationParameters,
) -> float:
    """Return the greatest sc(P) [rad²] among the polylines of the shared part (paper, V2).

    Parameters
    ----------
    lines
        The line map that `other` is the raster of.
    """
    coincides = coinciding(reference, other, transform, parameters)
    counts = np.bincount(other.segment, minlength=len(lines.segments))
    hits = np.bincount(other.segment[coincides], minlength=len(lines.segments))
    shared = hits >= parameters.shared_part * np.maximum(counts, 1)
    return float(complexities(lines.segments[shared], lines.polyline[shared]).max(initial=0.0))


def coinciding(
    reference: DistanceField,
    other: DistanceField,
    transform: FloatArray,
    parameters: VerificationParameters,
) -> BoolArray:
    """Tell which samples (n,) of the walls of `other` are on walls of `reference`."""
    limits = _limits(parameters)
    return judge_samples(other.samples, transform, reference.cells, limits)[0]


def contradicting(
    reference: DistanceField,
    other: DistanceField,
    transform: FloatArray,
    parameters: VerificationParameters,
) -> BoolArray:
    """Tell which samples (n,) of the walls of `other` lie where `reference` saw free space."""
    limits = _limits(parameters)
    return judge_samples(other.samples, transform, reference.cells, limits)[1]


def _both_ways(
    reference: DistanceField,
    other: DistanceField,
    transform: FloatArray,
    parameters: VerificationParameters,
) -> tuple[Weighed, Weighed]:
    """Look the samples of each map up in the other."""
    p = parameters
    return weigh_maps(_weighed(reference, p), _weighed(other, p), transform, _limits(p))


def _tallied(forward: Weighed, backward: Weighed) -> Tally:
    contradicted = forward.contradicted + backward.contradicted
    common = min(forward.common, backward.common)
    return Tally(common, contradicted)


def _weighed(raster: DistanceField, p: VerificationParameters) -> WeighedMap:
    """Return what verdicts are looked up by."""
    return WeighedMap(raster.samples, raster.weight, worth_of_missing(raster, p), raster.cells)


def _limits(p: VerificationParameters) -> Limits:
    return Limits(p.closeness, p.min_cosine, p.clearance)


def worth_of_missing(other: DistanceField, p: VerificationParameters) -> FloatArray:
    """(n,) what a metre of wall counts that is not there: a wall that is gone, in full.

    Worked out once.
    """
    limits = p.moved_gap, p.moved_side, p.moved_weight
    if limits not in other.missing:
        missing = np.ones(len(other.weight))
        if p.moved_weight < 1:
            missing[free_standing(other, p.moved_gap, p.moved_side)] = p.moved_weight
        other.missing[limits] = missing
    return other.missing[limits]
