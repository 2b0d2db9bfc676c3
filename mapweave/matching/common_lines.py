"""How many different straight lines two maps share: one corner is like every other.

Along two walls that meet, however long, any two corners of right angles lie on each other. A third
line tells more of a place.
"""

import numpy as np

from mapweave.geometry.arrays import FloatArray
from mapweave.maps import LineMap
from mapweave.matching.distance_field import DistanceField
from mapweave.matching.verification import VerificationParameters, coinciding

MIN_WALL = 0.5  # [m] of a line in common: less may be the end of another


def count_common_lines(
    reference: DistanceField,
    other: DistanceField,
    transform: FloatArray,
    lines: LineMap,
    parameters: VerificationParameters,
) -> int:
    """Return how many straight lines, each of half a metre of wall or more, are in both maps.

    Walls on one line, with the visible side on the same side, count once.

    Parameters
    ----------
    transform
        (3,) from `other` to `reference`.
    lines
        The line map that `other` is the raster of.
    """
    shared = coinciding(reference, other, transform, parameters)
    wall = np.bincount(other.segment[shared], other.weight[shared], minlength=len(lines.segments))
    found: list[tuple[FloatArray, FloatArray]] = []  # a point and the unit normal of each
    for k in np.argsort(-wall, kind="stable"):
        if wall[k] < MIN_WALL:
            break
        start, along = lines.segments[k, :2], lines.segments[k, 2:] - lines.segments[k, :2]
        normal = np.array([-along[1], along[0]]) / np.hypot(*along)
        middle = start + along / 2
        if not any(_is_on(middle, normal, *each, parameters) for each in found):
            found.append((middle, normal))
    return len(found)


def _is_on(
    middle: FloatArray,
    normal: FloatArray,
    point: FloatArray,
    other_normal: FloatArray,
    p: VerificationParameters,
) -> bool:
    """Whether a wall, by its middle and normal, lies on the line through `point`."""
    aside = abs((middle - point) @ other_normal)
    return bool(normal @ other_normal > p.min_cosine and aside < 2 * p.closeness)
