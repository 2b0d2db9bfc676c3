"""Coarse places: where a map may lie in another, by rasters of few cells, in a millisecond or two.

From coarse to fine: at each turn at which much wall is parallel (paper, VI-A) every shift is scored
in wide cells; the best are aligned on a raster half as fine as that which decides, and scored by
it. What a place counts there is what it counts when it is judged finely, but for some decimetres of
wall: where no place counts much, two maps need not be looked at any closer.

On 271 joined pairs of stretches of four recordings the right place was among those aligned, and
counted 8.6 m at the least; two in three of the refused have none above 6 m.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from pydantic import Field

from mapweave.geometry.arrays import FloatArray
from mapweave.kernels.matching.place_views import PlaceView, place_view
from mapweave.kernels.matching.shifts import best_shifts
from mapweave.lines.directions import likely_turns, mirrored_turns, turn_histogram
from mapweave.maps import LineMap
from mapweave.matching.distance_field import DistanceField, DistanceFieldParameters
from mapweave.matching.field_icp import FieldIcpParameters, align_on_raster
from mapweave.matching.verification import (
    DIRECTIONS,
    VerificationParameters,
    coarse_scores,
    said_by_cells,
    worth_of_missing,
)
from mapweave.parameters import StageParameters, derived


class CoarsePlaceParameters(StageParameters):
    """How coarse, and how many."""

    raster: DistanceFieldParameters = derived(
        lambda c: DistanceFieldParameters.of(c, cell=2 * c.mapping.resolution, same_wall=0.5)
    )
    width: float = derived(
        lambda c: 4 * c.mapping.resolution, gt=0, description="[m] of the cells that are shifted"
    )
    turns: int = Field(16, ge=1, description="the likeliest, in a building that is not rectangular")
    least_parallel: float = Field(
        0.15,
        ge=0,
        lt=1,
        description="of the parallel wall of the likeliest turn, for another to be tried; the right"
        " one of a joined pair had 0.22 at the least",
    )
    turn_separation: float = Field(0.17, gt=0, description="[rad] between two turns: 10°")
    closeness: float = derived(
        lambda c: 5 / 4 * c.mapping.closeness,
        gt=0,
        description="[m] within which walls coincide: in the cell of one, and in those beside",
    )
    clearance: float = derived(
        lambda c: 5 / 3 * c.mapping.clearance,
        gt=0,
        description="[m] inside seen free space from which a wall contradicts, shifted roughly",
    )
    shifts: int = Field(20, ge=1, description="of each turn, the best")
    moved_part: float = Field(
        0.5, ge=0, le=1, description="of a metre, that what may have been moved counts in cells"
    )
    aligned: int = Field(20, ge=1, description="of all turns, the best")
    alignment: FieldIcpParameters = FieldIcpParameters()
    samples: int = Field(120, ge=10, description="of a map's walls, scoring what was aligned")


@dataclass(frozen=True, slots=True, eq=False)
class CoarseMap:
    """A line map as it is looked for coarsely.

    Attributes
    ----------
    field
        Its raster.
    view
        What the raster's cells say, as of `verification.said_by_cells`, and its samples.
    directions
        (360,) of its walls, as of `directions.turn_histogram`.
    """

    field: DistanceField
    view: PlaceView
    directions: FloatArray

    @classmethod
    def of(
        cls, lines: LineMap, p: CoarsePlaceParameters, verification: VerificationParameters
    ) -> "CoarseMap":
        """Prepare `lines`, which have at least one segment.

        What may have been moved is looked for by a part of its metres.
        """
        field = DistanceField.of(lines, p.raster)
        moved = worth_of_missing(field, verification) < 1
        metres = np.where(moved, p.moved_part, 1.0) * field.weight
        samples = field.oriented.points, field.facing, metres
        codes = said_by_cells(field, p.closeness, p.clearance)
        view = place_view(codes, field.origin, field.cell, *samples)
        return cls(field, view, turn_histogram(lines.segments))


class CoarsePlaces(NamedTuple):
    """Where a map may lie in another.

    Attributes
    ----------
    aligned
        (k, 3) transforms from the other map to the reference, few.
    scores
        (k,) metres in common less contradicted, as of `verification.coarse_scores`.
    shifted
        (n, 3) all shifts that were handed on, not aligned: those are of the best of them.
    """

    aligned: FloatArray
    scores: FloatArray
    shifted: FloatArray


def coarse_places(
    here: CoarseMap,
    there: CoarseMap,
    parameters: CoarsePlaceParameters,
    verification: VerificationParameters,
) -> CoarsePlaces:
    """Look where the map `there` may lie in the one that is `here`."""
    p = parameters
    views, turns = (here.view, there.view), _turns(here.directions, there.directions, p)
    shifted, rough = _shifts(views, turns, p.shifts, p, verification)
    best = np.argsort(-rough, kind="stable")[: p.aligned]
    aligned = align_on_raster(here.field, there.field, shifted[best], p.alignment)
    scores = coarse_scores(here.field, there.field, aligned, p.samples, verification)
    return CoarsePlaces(aligned, scores, shifted)


def most_if_mirrored(
    here: CoarseMap,
    there: CoarseMap,
    parameters: CoarsePlaceParameters,
    verification: VerificationParameters,
) -> float:
    """Return the most that any shift of the map `there`, mirrored, counts in wide cells [m]."""
    p = parameters
    views = here.view, there.view.mirrored(DIRECTIONS)
    turns = _turns(here.directions, mirrored_turns(there.directions), p)
    return float(_shifts(views, turns, 1, p, verification)[1].max(initial=0.0))


def _turns(ours: FloatArray, theirs: FloatArray, p: CoarsePlaceParameters) -> FloatArray:
    """(k,) [rad] at which much of two maps' wall is parallel, of its histograms."""
    return likely_turns(ours, theirs, p.turns, p.turn_separation, p.least_parallel)


def _shifts(
    views: tuple[PlaceView, PlaceView],
    turns: FloatArray,
    count: int,
    p: CoarsePlaceParameters,
    verification: VerificationParameters,
) -> tuple[FloatArray, FloatArray]:
    """Return the best `count` shifts at each of (k,) `turns`, (n, 3), and what they count [m]."""
    weight = round(verification.contradiction_weight)
    return best_shifts(*views, turns, p.width, DIRECTIONS, weight, count)
