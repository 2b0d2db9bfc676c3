"""The best transforms of which no two are alike, and which transforms agree."""

from typing import cast

import numpy as np

from mapweave.kernels.arrays import FloatArray, IntArray
from mapweave.kernels.loading import COMPILED


def distinct_numpy(
    transforms: FloatArray,
    scores: FloatArray,
    middle: FloatArray,
    count: int,
    distance: float,
    angle: float,
) -> IntArray:
    """Twin of `distinct`."""
    turn = transforms[:, 2]
    c, s = np.cos(turn), np.sin(turn)
    x, y = middle
    place = transforms[:, :2] + np.column_stack([c * x - s * y, s * x + c * y])
    kept: list[int] = []
    left = np.argsort(-scores, kind="stable")
    while len(left) and len(kept) < count:
        kept.append(int(left[0]))
        apart = np.hypot(*(place[left] - place[kept[-1]]).T)
        turned = np.pi - np.mod(np.pi - (turn[left] - turn[kept[-1]]), 2 * np.pi)
        left = left[(apart > distance) | (np.abs(turned) > angle)]
    return np.array(kept, dtype=np.int64)


def distinct(
    transforms: FloatArray,
    scores: FloatArray,
    middle: FloatArray,
    count: int,
    distance: float,
    angle: float,
) -> IntArray:
    """Return the numbers of at most `count`, best first, each different from the better ones.

    Parameters
    ----------
    transforms
        (n, 3) [m, m, rad].
    scores
        (n,) of equals the earlier one comes first.
    middle
        (2,) of the map that is moved [m].
    distance, angle
        [m], [rad] by one of which two differ there.
    """
    compute = distinct_numpy if COMPILED is None else COMPILED.distinct
    return cast("IntArray", compute(transforms, scores, middle, count, distance, angle))


def agreeing_numpy(
    place: FloatArray, turn: FloatArray, count: int, distance: float, angle: float
) -> tuple[IntArray, IntArray, IntArray]:
    """Twin of `agreeing`."""
    left = np.ones(len(turn), dtype=np.bool_)
    bests, start, members = list[int](), [0], [np.empty(0, dtype=np.int64)]
    while left.any() and len(bests) < count:
        best = int(left.argmax())
        bests.append(best)
        apart = np.hypot(*(place - place[best]).T)
        turned = np.pi - np.mod(np.pi - (turn - turn[best]), 2 * np.pi)
        members.append(np.flatnonzero((apart <= distance) & (np.abs(turned) <= angle)))
        left[members[-1]] = left[best] = False
        start.append(start[-1] + len(members[-1]))
    numbers = np.array(bests, dtype=np.int64), np.array(start, dtype=np.int64)
    return (*numbers, np.concatenate(members))


def agreeing(
    place: FloatArray, turn: FloatArray, count: int, distance: float, angle: float
) -> tuple[IntArray, IntArray, IntArray]:
    """Return at most `count` groups of transforms, each of all that agree with its best.

    That is the first that is in no group before; others may be in several.

    Parameters
    ----------
    place
        (n, 2) where each puts the middle of the map that is moved [m].
    turn
        (n,) [rad].
    distance, angle
        [m], [rad] within both of which two agree.

    Returns
    -------
    best
        (g,) number of each group's.
    start
        (g + 1,) where each group begins among the members, and how many there are.
    members
        (m,) numbers, group by group, ascending in each.
    """
    compute = agreeing_numpy if COMPILED is None else COMPILED.agreeing
    return cast("tuple[IntArray, IntArray, IntArray]", compute(place, turn, count, distance, angle))
