"""Ranking: what two maps propose, aligned, judged and put in order (paper, VIII, H1 to V2).

A proposal is not taken or left, one after the other, as the paper prints it: the second best tells
whether the best is ambiguous.
"""

from dataclasses import replace

import numpy as np

from mapweave.fusion.decision import Hypothesis
from mapweave.fusion.parameters import FusionParameters
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.maps import LineMap
from mapweave.matching.distance_field import DistanceField
from mapweave.matching.hypotheses import PreparedMap, different, hypothesise
from mapweave.matching.icp import Target, align_all
from mapweave.matching.verification import shared_complexity, verify
from mapweave.shape.background import Counts, shares_without
from mapweave.shape.rarity import rarity, shared_ends

Fields = tuple[DistanceField, DistanceField]  # judged by: of the reference, and of the other


def find_alignments(
    first: PreparedMap, second: PreparedMap, p: FusionParameters, possible: FloatArray | None = None
) -> list[Hypothesis]:
    """Return the hypotheses that differ, best first; none where nothing proposes any."""
    transforms, _ = hypothesise(first, second, p.hypotheses, p.verification, possible)
    if len(transforms) == 0:
        return []
    return _ranked(first, second, _refined(first, second, transforms, p), p)


def _ranked(
    first: PreparedMap, second: PreparedMap, aligned: FloatArray, p: FusionParameters
) -> list[Hypothesis]:
    """Return the best two that differ of (k, 3) `aligned`."""
    fields = first.raster, second.raster
    verdicts = [verify(*fields, t, p.verification) for t in aligned]
    middle = fields[1].middle
    # Two that ended in the same place are one, and not each other's rival.
    ranked = different(aligned, np.array([v.score for v in verdicts]), middle, p.hypotheses)
    return [
        Hypothesis(
            aligned[k],
            se2.transform_points(aligned[k], middle),
            verdicts[k],
            _complexity(first.lines, second.lines, aligned[k], fields, p),
        )
        for k in ranked[:2]
    ]


def rated(
    hypothesis: Hypothesis,
    first: PreparedMap,
    second: PreparedMap,
    words: Counts,
    p: FusionParameters,
) -> Hypothesis:
    """Return `hypothesis` with how rare it is that two places have what both maps have (H1).

    Parameters
    ----------
    words
        Of both maps together.
    """
    asked = p.hypotheses.rarity
    shared = shared_ends(first.ends, second.ends, hypothesis.transform, asked)
    shares = shares_without(asked.left_out, asked.bins)
    bits = rarity(shared, shares, words, asked)
    return replace(hypothesis, rarity=bits)


def _refined(
    first: PreparedMap, second: PreparedMap, starts: FloatArray, p: FusionParameters
) -> FloatArray:
    """Align the walls of `second` to those of `first` (V1) from each of (k, 3) `starts`."""
    oriented = second.raster.oriented
    stride = 1 + (len(oriented) - 1) // p.icp_samples
    target = Target.of(first.raster.oriented, p.icp)
    # Held so loosely that any wall is stronger: only what no wall holds stays where it is.
    prior = np.diag([1 / p.loose**2, 1 / p.loose**2, 0.0])
    fits = align_all(oriented.at(slice(None, None, stride)), target, starts, p.icp, prior)
    return np.array([fit.pose for fit in fits])


def _complexity(
    first: LineMap, second: LineMap, transform: FloatArray, fields: Fields, p: FusionParameters
) -> float:
    """Return the complexity of what is shared [rad²], in the map that shows more of it (V2)."""
    here, there = fields
    back = se2.inverse(transform)
    return max(
        shared_complexity(here, there, transform, second, p.verification),
        shared_complexity(there, here, back, first, p.verification),
    )
