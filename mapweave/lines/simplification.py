"""The simplest map of what was seen: merged, placed, chosen, and its ends joined.

The paper merges until no pair is cheap enough (VI); what remains is its map. Here merging only
proposes walls. Which of them are kept, where they lie and where they end is decided by all that
was seen, so that few segments explain nearly all of it.
"""

import numpy as np
from pydantic import Field
from shapely.geometry.base import BaseGeometry

from mapweave.geometry.arrays import BoolArray, FloatArray, IntArray
from mapweave.geometry.segments import units
from mapweave.kernels.lines.evidence import find_shared
from mapweave.lines.collinear_junctions import StraighteningParameters, straighten
from mapweave.lines.corner_junctions import JoiningParameters, join_corners
from mapweave.lines.directions import main_directions
from mapweave.lines.fitting import FittingParameters, cut, fit, follow, trim
from mapweave.lines.merging import MergingParameters, evolve
from mapweave.lines.selection import (
    SelectionParameters,
    bearing,
    explained,
    select,
    shadowed,
    unsettled,
)
from mapweave.lines.sightings import Nearness, Sightings
from mapweave.lines.t_junctions import WallEndParameters, meet_walls
from mapweave.parameters import StageParameters, derived


class SimplificationParameters(StageParameters):
    """One model for each step."""

    spacing: float = derived(
        lambda c: c.mapping.resolution, gt=0, description="[m] between samples of what was seen"
    )
    missed: float = Field(
        0.5, gt=0, le=1, description="share of a sighting; less explained, it proposes walls anew"
    )
    min_length: float = Field(0.15, ge=0, description="[m] shorter segments are no walls")
    merging: MergingParameters = derived(MergingParameters.of)
    placement: FittingParameters = derived(FittingParameters.of)
    selection: SelectionParameters = derived(SelectionParameters.of)
    straightening: StraighteningParameters = derived(StraighteningParameters.of)
    joining: JoiningParameters = derived(JoiningParameters.of)
    wall_ends: WallEndParameters = derived(WallEndParameters.of)


def simplify(
    merged: FloatArray,
    sightings: FloatArray,
    counts: IntArray,
    free: BaseGeometry,
    parameters: SimplificationParameters | None = None,
    known: FloatArray | None = None,
) -> FloatArray:
    """Return the fewest segments that explain nearly all that was seen.

    Parameters
    ----------
    merged
        (n, 4) [m], directed: what merging left (paper, VI).
    sightings
        (k, 4) [m], the same frame: what it was merged from.
    counts
        (k,) how many scans each sighting stands for.
    free
        What was seen through: no wall grows into it.
    parameters
        Of each step.
    known
        (k, 4) [m], the same frame: walls that are there already. Only what they leave unexplained
        is to be explained.

    Returns
    -------
    FloatArray
        (m, 4) [m], directed, the one that explains most first; none of those known.
    """
    p = parameters or SimplificationParameters()
    known = np.empty((0, 4)) if known is None else known
    if not len(merged):
        return np.empty((0, 4))
    evidence = Sightings.of(sightings, counts, p.spacing).gathered()
    price = p.selection.price * evidence.weights.sum() / max(_wall(merged), 1e-9)
    evidence = unsettled(known, evidence, p.selection)
    _, lengths = units(sightings)
    directions = main_directions(sightings, lengths * counts, p.merging.directions)
    candidates = _placed(merged, evidence, directions, free, p)
    near = bearing(candidates, evidence, p.selection)
    chosen = select(len(candidates), near, evidence, price, p.selection)
    missed = unexplained(np.concatenate([known, candidates[chosen]]), sightings, p)
    if missed.any():
        again = _proposed_again(sightings[missed], counts[missed], p)
        others = _placed(again, evidence, directions, free, p)
        near = near.followed_by(bearing(others, evidence, p.selection), len(candidates))
        candidates = np.concatenate([candidates, others])
        chosen = select(len(candidates), near, evidence, price, p.selection)
    trimmed = _trimmed(candidates[chosen], near.of_segments(chosen), evidence, p)
    walls = straighten(trimmed, free, p.straightening)
    return meet_walls(join_corners(walls, free, p.joining), free, p.wall_ends)


def sources(
    segments: FloatArray,
    sightings: FloatArray,
    parameters: SimplificationParameters | None = None,
) -> tuple[IntArray, IntArray]:
    """Return pairs of a segment and a sighting of it: most of the one lies along the other.

    Parameters
    ----------
    segments, sightings
        (n, 4) and (k, 4) [m], one frame.
    parameters
        Those that the segments were simplified with: what was of a segment then is a sighting now.
    """
    p = parameters or SimplificationParameters()
    segment, source, shared, _ = find_shared(
        segments, sightings, 2 * p.spacing, p.placement.tolerance, np.cos(p.placement.parallel)
    )
    _, wall = units(segments)
    _, seen = units(sightings)
    enough = shared >= np.minimum(wall[segment], seen[source]) / 2
    return segment[enough], source[enough]


def _placed(
    segments: FloatArray,
    evidence: Sightings,
    directions: FloatArray,
    free: BaseGeometry,
    p: SimplificationParameters,
) -> FloatArray:
    """Return the parts of `segments` that lie where most was seen, in main directions if near."""
    fitted = fit(segments, evidence, p.placement)
    straight = follow(fitted, directions, p.merging.direction_tolerance, p.merging.max_shift)
    placed = cut(straight, evidence, free, p.placement)
    return placed[_is_long(placed, p)]


def _proposed_again(
    sightings: FloatArray, counts: IntArray, p: SimplificationParameters
) -> FloatArray:
    """Merge (paper, VI) what the chosen do not explain: apart from them it may show walls."""
    _, lengths = units(sightings)
    merged = evolve(sightings, lengths * counts, p.merging).segments
    return merged[_is_long(merged, p)]


def unexplained(
    chosen: FloatArray, sightings: FloatArray, parameters: SimplificationParameters
) -> BoolArray:
    """Return (k,) which `sightings` (k, 4) [m] the `chosen` (n, 4) [m] explain too little of."""
    p = parameters
    *_, covered = find_shared(
        chosen, sightings, 2 * p.spacing, p.selection.tolerance, p.selection.min_cosine
    )
    return np.asarray(covered < p.missed)


def _trimmed(
    chosen: FloatArray, near: Nearness, evidence: Sightings, p: SimplificationParameters
) -> FloatArray:
    """Return the `chosen`, `near` which that evidence is, without what earlier ones stand for."""
    explains = explained(near, p.selection) & (near.distance <= p.selection.shadow)
    settles = explains | shadowed(near, p.selection)
    trimmed = trim(chosen, near, explains, settles, evidence)
    return trimmed[_is_long(trimmed, p)]


def _is_long(segments: FloatArray, p: SimplificationParameters) -> BoolArray:
    _, lengths = units(segments)
    return np.asarray(lengths >= p.min_length)


def _wall(segments: FloatArray) -> float:
    return float(units(segments)[1].sum())
