"""Equal stretches of two maps, found whatever their position (paper, VIII: H1 and H2; V, parts).

A *window* is a stretch of fixed arc length of a generalized polyline. Windows slide along every
polyline, so that parts are compared with parts: a polyline seen in part still has most of its
windows. The turn angle at m equal steps of arc length is written as a complex number exp(iθ).
Turning a window by α multiplies its codes by exp(iα), so for windows a and b

    Σ a conj(b) = m · similarity · exp(i · rotation),    0 <= similarity <= 1,

holds both how alike they are and the rotation from b to a that makes them so; *all* pairs of two
maps are one matrix product. For small angles 1 - similarity is half the paper's s(C, D), which is
the variance of the difference of turn angles (tangent_space.py); unlike it, codes need no
unwrapping and one outlier cannot grow without bound.

Position independent does not mean without points: a rotation and the two centres of the sample
points give the rigid motion, and how far the points are apart after it (the residual) tells
windows whose gaps or scale differ, which turn angles over arc length cannot.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import NamedTuple

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, PositiveFloat

from mapweave.geometry.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from mapweave.geometry.segments import lengths
from mapweave.kernels.matching.windows import WindowSamples, alike_windows, sample_windows


class WindowParameters(BaseModel):
    """How windows are cut and which pairs of them become candidates.

    The defaults were chosen on pairs of single scans, 1 to 4 m apart (fr079, Intel): which share
    of them had the true pose among the first 1, 5, 20 different candidates.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    lengths: tuple[PositiveFloat, ...] = Field(
        (0.7, 1.5, 3.0, 6.0),
        min_length=1,
        description="[m] arc lengths: of a door frame, a corner, a niche, half a room",
    )
    samples: int = Field(
        24, ge=2, description="of a window: a corner misplaced by one costs 4 % of similarity"
    )
    stride: float = Field(
        0.1, gt=0, description="from window to window, as a share of their length"
    )
    min_complexity: float = Field(
        0.05, ge=0, le=1, description="least salience (H1): below lie walls with a wobble"
    )
    min_similarity: float = Field(
        0.7, ge=0, le=1, description="least similarity (H2): of a line and an even right angle"
    )
    max_residual: float = Field(
        0.5, gt=0, description="[m] rms beyond which points are of different places"
    )
    min_gain: float = Field(
        -0.1,
        ge=-1,
        le=1,
        description="least similarity beyond that of either window to a straight line; below 0 for"
        " the true pairs that noise and phase make a little less alike",
    )
    residual_scale: float = Field(
        3.0, gt=0, description="[m] rms that would outweigh a similarity of 1 in the score"
    )
    max_windows: int = Field(
        1000, gt=0, description="the most salient of a map, for each length: some 70 MB at most"
    )
    max_candidates: int = Field(250, gt=0, description="returned for each length, best first")


@dataclass(frozen=True, slots=True, eq=False)
class Windows:
    """All windows of one arc length of a map.

    Attributes
    ----------
    length
        Of each window [m].
    codes
        (k, m) exp(i · direction) at the samples, of modulus 1.
    points
        (k, m, 2) where the samples are [m], map frame.
    polyline
        (k,) the polyline each lies on; ascending, and along the polyline within it.
    arc
        (k,) where each begins on its polyline: its arc length from the polyline's start [m].
    """

    length: float
    codes: ComplexArray
    points: FloatArray
    polyline: IntArray
    arc: FloatArray

    @property
    def straightness(self) -> FloatArray:
        """(k,) similarity of each to a straight line, in [0, 1]."""
        straightness: FloatArray = np.minimum(np.abs(self.codes.mean(axis=1)), 1)
        return straightness

    @property
    def complexity(self) -> FloatArray:
        """(k,) 1 - straightness², for small angles the paper's sc(P) (VIII-B), in [0, 1]."""
        return complexity_of(self.straightness)


@dataclass(frozen=True, slots=True, eq=False)
class Candidates:
    """Pairs of similar windows of a map a and a map b, each a hypothesis of their alignment.

    Attributes
    ----------
    score
        (p,) arc length explained [m], best first: the similarity, less that to a straight line,
        less residual / residual_scale, times the length.
    similarity
        (p,) in [0, 1].
    transform
        (p, 3) takes coordinates in b to coordinates in a [m, m, rad]; its angle in [-π, π] is the
        best rotation of the turn angles.
    residual
        (p,) rms distance of corresponding points after it [m].
    length
        (p,) of the windows [m].
    window_a, window_b
        (p,) which windows of that length.
    """

    score: FloatArray
    similarity: FloatArray
    transform: FloatArray
    residual: FloatArray
    length: FloatArray
    window_a: IntArray
    window_b: IntArray

    def __len__(self) -> int:
        return len(self.score)

    def take(self, which: IntArray | BoolArray) -> "Candidates":
        """Return those that the index or mask names."""
        return Candidates(*(getattr(self, field.name)[which] for field in fields(self)))


def has_salient(windows: Windows, parameters: WindowParameters) -> bool:
    """Whether a window is complex enough to be compared (H1)."""
    return bool((windows.complexity >= parameters.min_complexity).any())


def complexity_of(straightness: FloatArray) -> FloatArray:
    """(k,) complexity of windows of such a similarity (k,) to a straight line."""
    return 1 - straightness**2


def windows(
    segments: FloatArray, polyline: IntArray, length: float, samples: int, stride: float
) -> Windows:
    """Return the windows that slide along every polyline of a map.

    Parameters
    ----------
    segments
        (n, 4) x1 y1 x2 y2 [m], polyline by polyline, in order.
    polyline
        (n,) the polyline of each, ascending.
    length
        Arc length of a window [m]; polylines shorter than it have none.
    samples
        How many samples a window has; each stands for the middle of an equal share of its length.
    stride
        Distance from one window to the next [m].
    """
    return _cut(segments, _arcs(segments, polyline), length, samples, stride)


def _cut(
    segments: FloatArray, arcs: "_Arcs", length: float, samples: int, stride: float
) -> Windows:
    """Return the windows of one length; none crosses polylines."""
    count = np.floor((arcs.total - length) / stride + 1e-9).astype(np.int64) + 1
    count = np.maximum(count, 0)
    place = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
    arc = place * stride
    codes, points = sample_windows(segments, np.repeat(arcs.before, count) + arc, length, samples)
    return Windows(length, codes, points, np.repeat(arcs.polyline, count), arc)


class _Arcs(NamedTuple):
    """(p,) polylines, what of the map's arc length lies before each, and how long it is [m]."""

    polyline: IntArray
    before: FloatArray
    total: FloatArray


def _arcs(segments: FloatArray, polyline: IntArray) -> _Arcs:
    first = np.flatnonzero(np.diff(polyline, prepend=polyline[:1] - 1))
    total = np.add.reduceat(lengths(segments), first) if len(first) else np.empty(0)
    return _Arcs(polyline[first], np.cumsum(total) - total, total)


def all_windows(
    segments: FloatArray, polyline: IntArray, parameters: WindowParameters
) -> tuple[Windows, ...]:
    """Return a map's windows of every arc length of the parameters.

    Parameters
    ----------
    segments
        (n, 4) x1 y1 x2 y2 [m], polyline by polyline, in order.
    polyline
        (n,) the polyline of each, ascending.
    parameters
        Arc lengths, samples and stride.
    """
    p, arcs = parameters, _arcs(segments, polyline)
    return tuple(_cut(segments, arcs, length, p.samples, p.stride * length) for length in p.lengths)


def match(a: Windows, b: Windows, parameters: WindowParameters) -> Candidates:
    """Return the pairs of salient, similar windows of one arc length, best first (H1, H2).

    A pair clearly less alike than one of its windows is to a straight line explains nothing and
    is left out. Of neighbouring pairs, one stride away on one or both polylines, only the one
    that explains most stays: they stand for one alignment.

    Parameters
    ----------
    a, b
        Windows of two maps, cut alike.
    parameters
        What is salient, similar and close enough, and how many to return.
    """
    straight, others = a.straightness, b.straightness
    rows, columns = _salient(straight, parameters), _salient(others, parameters)
    product = a.codes[rows] / a.codes.shape[1] @ b.codes[columns].conj().T
    ours, theirs = _samples(a, rows, straight), _samples(b, columns, others)
    pairs = alike_windows(product, ours, theirs, parameters.min_similarity, parameters.min_gain)
    score = a.length * (pairs.gain - pairs.residual / parameters.residual_scale)
    close = np.flatnonzero(pairs.residual <= parameters.max_residual)
    kept = close[np.argsort(-score[close], kind="stable")[: parameters.max_candidates]]
    return Candidates(
        score[kept],
        pairs.similarity[kept],
        pairs.transform[kept],
        pairs.residual[kept],
        np.full(len(kept), a.length),
        rows[pairs.row[kept]],
        columns[pairs.column[kept]],
    )


def match_all(
    a: Sequence[Windows], b: Sequence[Windows], parameters: WindowParameters
) -> Candidates:
    """Return the candidates of every arc length, as of `match`, best first.

    Parameters
    ----------
    a, b
        Of two maps, from `all_windows` with the same parameters.
    """
    parts = [match(one, other, parameters) for one, other in zip(a, b, strict=True)]
    joined = [
        np.concatenate([getattr(part, field.name) for part in parts])
        for field in fields(Candidates)
    ]
    return best(Candidates(*joined), len(joined[0]))


def best(candidates: Candidates, count: int) -> Candidates:
    """Return the `count` candidates of the highest score, best first; of equals the earlier one."""
    return candidates.take(np.argsort(-candidates.score, kind="stable")[:count])


def _salient(straightness: FloatArray, parameters: WindowParameters) -> IntArray:
    """Return which windows are the most complex (H1), in their order on the map."""
    complexity = complexity_of(straightness)
    salient = np.flatnonzero(complexity >= parameters.min_complexity)
    if len(salient) <= parameters.max_windows:
        return salient
    ranked: IntArray = np.argsort(-complexity[salient], kind="stable")[: parameters.max_windows]
    return np.sort(salient[ranked])


def _samples(windows: Windows, chosen: IntArray, straightness: FloatArray) -> WindowSamples:
    """Return the chosen windows as they are compared."""
    return WindowSamples(straightness[chosen], _places(windows, chosen), windows.points[chosen])


def _places(windows: Windows, chosen: IntArray) -> IntArray:
    """Return places, from 1, for the chosen windows: successive ones for neighbours alone."""
    neighbours = (np.diff(chosen) == 1) & (np.diff(windows.polyline[chosen]) == 0)
    skipped: IntArray = np.cumsum(np.concatenate([[1], ~neighbours]))[: len(chosen)]
    place: IntArray = np.arange(len(chosen)) + skipped
    return place
