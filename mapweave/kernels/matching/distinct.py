"""The best transforms of which no two are alike."""

from typing import cast

import numpy as np

from mapweave.kernels.arrays import FloatArray, IntArray
from mapweave.kernels.loading import COMPILED


def distinct_numpy(
    place: FloatArray,
    turn: FloatArray,
    scores: FloatArray,
    count: int,
    distance: float,
    angle: float,
) -> IntArray:
    """Twin of `distinct`."""
    kept: list[int] = []
    left = np.argsort(-scores, kind="stable")
    while len(left) and len(kept) < count:
        kept.append(int(left[0]))
        apart = np.hypot(*(place[left] - place[kept[-1]]).T)
        turned = np.pi - np.mod(np.pi - (turn[left] - turn[kept[-1]]), 2 * np.pi)
        left = left[(apart > distance) | (np.abs(turned) > angle)]
    return np.array(kept, dtype=np.int64)


def distinct(
    place: FloatArray,
    turn: FloatArray,
    scores: FloatArray,
    count: int,
    distance: float,
    angle: float,
) -> IntArray:
    """Return the numbers of at most `count`, best first, each different from the better ones.

    Parameters
    ----------
    place
        (n, 2) where each puts the middle of the map that is moved [m].
    turn
        (n,) [rad].
    scores
        (n,) of equals the earlier one comes first.
    distance, angle
        [m], [rad] by one of which two differ.
    """
    compute = distinct_numpy if COMPILED is None else COMPILED.distinct
    return cast("IntArray", compute(place, turn, scores, count, distance, angle))
