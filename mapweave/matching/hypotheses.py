"""Hypotheses: rigid transforms that two maps propose (in the place of H1 and H2; paper, VIII).

Salient windows of polylines (shape, as in the paper), corners of walls, and parallel walls each
propose transforms. All proposals are scored at once by what both maps saw; the best that differ
are aligned, all at once, and scored again; the best that clearly differ are handed on.

The three overlap so far that shape is not what decides: without windows and corners the shifts of
parallel walls still propose the right transform (``python -m benchmarks reference`` measures it;
figures in docs/paper.md). The loop as the paper prints it is `mapweave.fusion.reference`.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from pydantic import Field

from mapweave.geometry.arrays import FloatArray
from mapweave.kernels.matching.distinct import distinct
from mapweave.lines.directions import likely_turns
from mapweave.maps import LineMap
from mapweave.matching.coarse_places import CoarseMap, CoarsePlaceParameters
from mapweave.matching.distance_field import DistanceField, DistanceFieldParameters
from mapweave.matching.fft_correlation import FftCorrelationParameters, Marks, correlate
from mapweave.matching.field_icp import FieldIcpParameters, align_on_raster
from mapweave.matching.verification import VerificationParameters, coarse_scores
from mapweave.parameters import StageParameters, derived
from mapweave.shape.background import Counts
from mapweave.shape.corners import CornerParameters, Corners, find_corners, propose
from mapweave.shape.rarity import RarityParameters, WallEnds, count_words, wall_ends
from mapweave.shape.windows import WindowParameters, Windows, all_windows, match_all


class HypothesisParameters(StageParameters):
    """What proposes, and how many proposals survive."""

    windows: WindowParameters = WindowParameters(
        lengths=(1.5, 4.0), samples=16, stride=0.15, max_windows=250, max_candidates=200
    )
    corners: CornerParameters = CornerParameters()
    correlation: FftCorrelationParameters = derived(FftCorrelationParameters.of)
    coarse: CoarsePlaceParameters = derived(CoarsePlaceParameters.of)
    rarity: RarityParameters = RarityParameters()
    turn_separation: float = Field(0.17, gt=0, description="[rad] between likely turns: 10°")
    alignment: FieldIcpParameters = FieldIcpParameters()
    proposal_samples: int = Field(60, ge=10, description="of a map's walls, scoring proposals")
    max_proposals: int = Field(
        20_000, ge=1, description="scored so; of more, the best by a quarter of the samples"
    )
    aligned: int = Field(50, ge=2, description="proposals that are aligned, the best")
    start_distance: float = Field(0.4, gt=0, description="[m] between those: what alignment mends")
    start_turn: float = Field(0.09, gt=0, description="[rad] between those: 5°")
    max_samples: int = Field(250, ge=10, description="of a map's walls, scoring what was aligned")
    distance: float = Field(1.0, gt=0, description="[m] between different hypotheses (design)")
    turn: float = Field(0.157, gt=0, description="[rad] between different hypotheses: 9° (design)")
    count: int = Field(5, ge=2, description="handed on")


@dataclass(frozen=True, eq=False)
class PreparedMap:
    """A line map with what comparing it takes, made once for each map, and when it is asked for."""

    lines: LineMap
    parameters: HypothesisParameters
    raster_parameters: DistanceFieldParameters
    verification: VerificationParameters

    @cached_property
    def raster(self) -> DistanceField:
        """Its walls and the free space, as fine as decides."""
        return DistanceField.of(self.lines, self.raster_parameters)

    @cached_property
    def coarse(self) -> CoarseMap:
        """The same, as it is looked for first."""
        return CoarseMap.of(self.lines, self.parameters.coarse, self.verification)

    @property
    def wall(self) -> float:
        """[m] of it, drawn twice or not."""
        return float(self.coarse.field.weight.sum())

    @property
    def side(self) -> float:
        """[m] the longer side of the upright rectangle around it."""
        ends = self.lines.segments.reshape(-1, 2)
        return float(np.ptp(ends, axis=0).max())

    @cached_property
    def windows(self) -> tuple[Windows, ...]:
        """Stretches of its polylines."""
        return all_windows(self.lines.segments, self.lines.polyline, self.parameters.windows)

    @cached_property
    def corners(self) -> Corners:
        """Pairs of walls that meet."""
        return find_corners(self.lines.segments, self.parameters.corners)

    @cached_property
    def ends(self) -> WallEnds:
        """Of its walls, each once."""
        return wall_ends(self.lines.segments, self.parameters.rarity)

    @cached_property
    def words(self) -> Counts:
        """How often which pair of those is there."""
        return count_words(self.ends, self.parameters.rarity)


def hypothesise(
    reference: PreparedMap,
    other: PreparedMap,
    parameters: HypothesisParameters,
    verification: VerificationParameters,
    proposals: FloatArray | None = None,
) -> tuple[FloatArray, FloatArray]:
    """Return (k, 3) transforms from `other` to `reference`, and their (k,) coarse scores [m].

    Best first; any two differ by more than `parameters.distance` or `parameters.turn`, measured
    at the middle of `other`.

    Parameters
    ----------
    proposals
        (n, 3) all that is possible, where that is known; without it, the two maps propose.
    """
    p = parameters
    if proposals is None:
        shifted, _ = propose_by_walls(reference, other, p, verification)
        proposals = propose_all(reference, other, shifted, p)
    if len(proposals) > p.max_proposals:
        few = p.proposal_samples // 4
        first = coarse_scores(reference.raster, other.raster, proposals, few, verification)
        proposals = proposals[np.argpartition(-first, p.max_proposals)[: p.max_proposals]]
    middle = other.raster.middle
    rough = coarse_scores(
        reference.raster, other.raster, proposals, p.proposal_samples, verification
    )
    starts = _distinct(proposals, rough, middle, p.aligned, (p.start_distance, p.start_turn))
    aligned = align_on_raster(reference.raster, other.raster, proposals[starts], p.alignment)
    scores = coarse_scores(reference.raster, other.raster, aligned, p.max_samples, verification)
    kept = different(aligned, scores, middle, p)
    return aligned[kept], scores[kept]


def propose_by_walls(
    reference: PreparedMap,
    other: PreparedMap,
    parameters: HypothesisParameters,
    verification: VerificationParameters,
) -> tuple[FloatArray, FloatArray]:
    """Return (n, 3) transforms that lay parallel walls on each other, and their (n,) scores [m].

    These are of walls in cells: about what `verify` makes of them, once aligned.
    """
    p = parameters
    directions = reference.coarse.directions, other.coarse.directions
    turns = likely_turns(*directions, p.correlation.turns, p.turn_separation)
    marks = [
        Marks.of(shape.raster, verification.closeness, p.correlation.clearance)
        for shape in (reference, other)
    ]
    weight = verification.contradiction_weight
    return correlate(marks[0], marks[1], turns, weight, p.correlation)


def propose_all(
    reference: PreparedMap, other: PreparedMap, shifted: FloatArray, p: HypothesisParameters
) -> FloatArray:
    """(n, 3) of windows alike, of corners alike, and `shifted`, of parallel walls."""
    similar = match_all(reference.windows, other.windows, p.windows)
    cornered = propose(reference.corners, other.corners, p.corners)
    return np.vstack([similar.transform, cornered, shifted])


def different(
    transforms: FloatArray, scores: FloatArray, middle: FloatArray, p: HypothesisParameters
) -> list[int]:
    """Return indices of the best of (n, 3) `transforms`, each different from the better ones."""
    return _distinct(transforms, scores, middle, p.count, (p.distance, p.turn))


def _distinct(
    transforms: FloatArray,
    scores: FloatArray,
    middle: FloatArray,
    count: int,
    least: tuple[float, float],
) -> list[int]:
    """Return indices of at most `count`, best first, `least` [m], [rad] apart at `middle` (2,)."""
    kept: list[int] = distinct(transforms, scores, middle, count, *least).tolist()
    return kept
