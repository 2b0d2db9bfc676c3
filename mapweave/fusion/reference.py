"""The paper's loop as it is printed: H1, H2, V1, V2 (paper, VIII).

What mapweave joins maps with is `mapweave.fusion.align`. This is what it departs from, kept beside
it so that both can be measured (`python -m benchmarks reference`) and the paper be read in code.
What the text leaves open is chosen in the plainest way, and said where it is. It is a reference,
not a program to rely on: V2 as printed sees no free space and knows no runner-up, and the part that
proposed a transform may be the very polyline that confirms it.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from pydantic import BaseModel, ConfigDict, Field

from mapweave.geometry import se2
from mapweave.geometry.arguments import as_segments
from mapweave.geometry.arrays import BoolArray, FloatArray
from mapweave.geometry.segments import lengths
from mapweave.maps import LineMap
from mapweave.shape.partial_match import best_match
from mapweave.shape.stretch import stretch_of
from mapweave.shape.tangent_space import complexities, complexity, similarity, tangent_space


class ReferenceParameters(BaseModel):
    """The thresholds that section VIII calls predefined and does not give."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    part_segments: int | None = Field(
        None,
        ge=1,
        description="consecutive segments of a polyline that make an object P_i (H1), sliding"
        " along it; by default all of them: the polyline as it is in the map",
    )
    min_complexity: float = Field(
        0.05, ge=0, description="[rad²] sc(P_i) that is sufficient, in H1 and in V2"
    )
    hausdorff: float = Field(0.25, gt=0, description="[m] below which segments are close (V2)")


@dataclass(frozen=True, slots=True, eq=False)
class Counterpart:
    """Q_j, what of M_2 is most like an object of M_1.

    Attributes
    ----------
    stretch
        (k, 4) the stretch of a polyline of M_2 [m], its frame: as long as the object.
    similarity
        s(P_i, Q_j) [rad²].
    """

    stretch: FloatArray
    similarity: float


@dataclass(frozen=True, slots=True, eq=False)
class Proposal:
    """One round of the loop: a correspondence P_i ~ Q_j and what it comes to.

    Attributes
    ----------
    part
        (n, 4) P_i [m], frame of M_1.
    complexity
        sc(P_i) [rad²].
    counterpart
        Q_j, with s(P_i, Q_j).
    transform
        (3,) from M_2 to M_1 [m, m, rad], of V1.
    shared_complexity
        The greatest sc among the polylines of M_1' [rad²], of V2; 0 where nothing is close.
    confirmed
        Whether that is sufficient (V2).
    """

    part: FloatArray
    complexity: float
    counterpart: Counterpart
    transform: FloatArray
    shared_complexity: float
    confirmed: bool


def first_confirmed(
    reference: LineMap, other: LineMap, parameters: ReferenceParameters | None = None
) -> Proposal | None:
    """Return the first proposal that V2 confirms; None where the maps cannot be fused (VIII).

    Parameters
    ----------
    reference, other
        M_1 and M_2, each in a frame of its own.
    """
    return next((p for p in proposals(reference, other, parameters) if p.confirmed), None)


def proposals(
    reference: LineMap, other: LineMap, parameters: ReferenceParameters | None = None
) -> Iterator[Proposal]:
    """Yield every round of the loop, the most salient object first, confirmed or not (VIII).

    A reader takes as many as he wants: the loop of the paper ends at the first one confirmed.

    Parameters
    ----------
    reference, other
        M_1 and M_2, each in a frame of its own.
    """
    p = parameters or ReferenceParameters()
    for part in salient_parts(reference, p):  # H1
        found = most_similar(part, other)  # H2
        if found is None:
            continue  # no polyline of M_2 is as long: nothing to validate, back to H1
        transform = congruent_alignment(part, found.stretch)  # V1
        shared = shared_complexity(reference, other.moved(transform), p.hausdorff)  # V2
        confirmed = shared > p.min_complexity
        yield Proposal(part, complexity(part), found, transform, shared, confirmed)


def salient_parts(lines: LineMap, parameters: ReferenceParameters) -> list[FloatArray]:
    """Return the objects P_i of a map, the most complex first (VIII, H1).

    "Select the most salient object P_i of map M_1 as sequence of consecutive line segments with
    maximal shape complexity sc that has not been selected before. … If the selected P_i does not
    have sufficient shape complexity (sc(P_i) is not above a predefined threshold), terminate."

    Returns
    -------
    list of FloatArray
        (n, 4) each [m], frame of the map; of equally complex ones the earlier one first.
    """
    parts = [part for each in lines.polylines for part in _sequences(each, parameters)]
    if not parts:
        return []
    owner = np.repeat(np.arange(len(parts)), [len(part) for part in parts])
    salience = complexities(np.concatenate(parts), owner)
    ranked = np.argsort(-salience, kind="stable")
    return [parts[k] for k in ranked if salience[k] > parameters.min_complexity]


def _sequences(polyline: FloatArray, p: ReferenceParameters) -> list[FloatArray]:
    """Every sequence of as many consecutive segments as an object has; one, where it has all."""
    count = min(p.part_segments or len(polyline), len(polyline))
    return [polyline[k : k + count] for k in range(len(polyline) - count + 1)]


def most_similar(part: FloatArray, lines: LineMap) -> Counterpart | None:
    """Return the stretch Q_j of a map that is most like (n, 4) `part` [m] (VIII, H2, and VIII-C).

    "Using a shape similarity measure s find a polyline Q_j of map M_2 for which s(P_i, Q_j) is
    minimal", "implemented using a sliding window on the list of line segments in M_2". A window is
    as long as `part` and lies on one polyline; None where no polyline is as long.
    """
    length = tangent_space(part).length
    long = [each for each in lines.polylines if _length(each) >= length]
    matches = [(best_match(part, each), each) for each in long]
    if not matches:
        return None
    best, polyline = min(matches, key=lambda match: match[0].similarity)
    return Counterpart(stretch_of(polyline, best.start, best.end), best.similarity)


def congruent_alignment(part: ArrayLike, match: ArrayLike) -> FloatArray:
    """Return the transform that lays polyline `match` on polyline `part` congruently (VIII, V1).

    s "not only measures shape differences, but also determines the points' correspondence and the
    rotation needed": points at equal shares of the arc length correspond, the rotation is
    Θ(match, part), and the translation is that of least squares over all points: it lays the
    centroid of the one on that of the other.

    Parameters
    ----------
    part, match
        (n, 4) and (m, 4) x1 y1 x2 y2 [m], or (n, 2) vertices [m], each in the frame of its map.

    Returns
    -------
    FloatArray
        (3,) takes coordinates of `match` to coordinates of `part` [m, m, rad].

    Raises
    ------
    ArgumentError
        If one of them has another shape, or holds NaN or infinity.
    NoShapeError
        If one of them has no length.
    """
    part, match = as_segments("part", part), as_segments("match", match)
    _, theta = similarity(match, part)
    shift = _centroid(part) - se2.rotation(theta) @ _centroid(match)
    return np.array([shift[0], shift[1], theta])


def shared_complexity(reference: LineMap, other: LineMap, threshold: float) -> float:
    """Return the greatest sc [rad²] among the polylines of M_1', the part close to M_2 (VIII, V2).

    Parameters
    ----------
    reference, other
        M_1 and M_2 in a common coordinate system.
    threshold
        Of the Hausdorff distance [m].
    """
    close, _ = close_parts(reference.segments, other.segments, threshold)
    return float(
        complexities(reference.segments[close], reference.polyline[close]).max(initial=0.0)
    )


def close_parts(
    first: ArrayLike, second: ArrayLike, threshold: float
) -> tuple[BoolArray, BoolArray]:
    """Tell which segments are of M_1' and of M_2', so that H(M_1', M_2') is below `threshold` (V2).

    Those that have a segment of the other map within the threshold: each point of one part is then
    nearer than that to a point of the other. A wall that one map has whole and the other in pieces
    is in neither, as the paper says nothing about that.

    Parameters
    ----------
    first, second
        (n, 4) and (m, 4) x1 y1 x2 y2 [m], one frame.
    """
    near = hausdorff(first, second) < threshold
    return np.asarray(near.any(axis=1)), np.asarray(near.any(axis=0))


def hausdorff(first: ArrayLike, second: ArrayLike) -> FloatArray:
    """Return the (n, m) Hausdorff distances of segments [m] (VIII-C).

    "Hausdorff distance of line segments can be implemented by considering their endpoints": the
    distance to a segment is convex along a line, and greatest at an end.

    Parameters
    ----------
    first, second
        (n, 4) and (m, 4) x1 y1 x2 y2 [m], one frame.
    """
    first, second = as_segments("first", first), as_segments("second", second)
    there = np.maximum(_distance(first[:, :2], second), _distance(first[:, 2:], second))
    back = np.maximum(_distance(second[:, :2], first), _distance(second[:, 2:], first))
    return np.asarray(np.maximum(there, back.T))


def _distance(points: FloatArray, segments: FloatArray) -> FloatArray:
    """(n, m) distances of (n, 2) points to (m, 4) segments [m]."""
    start, along = segments[:, :2], segments[:, 2:] - segments[:, :2]
    offset = points[:, None] - start
    squared = np.maximum((along**2).sum(axis=1), np.finfo(float).tiny)
    share = np.clip((offset * along).sum(axis=-1) / squared, 0.0, 1.0)
    return np.asarray(np.linalg.norm(offset - share[..., None] * along, axis=-1))


def _centroid(polyline: FloatArray) -> FloatArray:
    """(2,) mean of all points of a polyline by arc length [m]."""
    weight = lengths(polyline)
    middles = (polyline[:, :2] + polyline[:, 2:]) / 2
    return np.asarray(weight @ middles / weight.sum())


def _length(polyline: FloatArray) -> float:
    return float(lengths(polyline).sum())
