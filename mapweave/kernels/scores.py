"""What two maps say of many transforms between them, by few samples: one look-up for each.

In single precision, as the cells are coarser than that.
"""

from typing import NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from mapweave.kernels.arrays import Float32Array, FloatArray
from mapweave.kernels.loading import COMPILED

Codes = NDArray[np.uint8]
TURNS = 4  # added to directions, so that turned ones are above 0
AT_ONCE = 20_000  # transforms: their samples take some 10 MB an array


class ScoredMap(NamedTuple):
    """A map: samples of its walls, and what its cells say.

    Attributes
    ----------
    points, facing
        (n, 2) samples [m], and (n,) where they face, in [0, 1) turns.
    weight
        (n,) [m] of wall that each stands for.
    missing
        (n,) times what it is worth, where that is below 0.
    origin, cell
        (2,) the cells' corner [m]; their size [m].
    codes
        (rows, columns) which row of the table a cell is worth: beyond the rim, what the rim says.
    """

    points: FloatArray
    facing: FloatArray
    weight: FloatArray
    missing: FloatArray
    origin: FloatArray
    cell: float
    codes: Codes


def mutual_scores_numpy(
    reference: ScoredMap, other: ScoredMap, transforms: FloatArray, most: int, worth: Float32Array
) -> FloatArray:
    """Twin of `mutual_scores`."""
    scores = np.empty(len(transforms))
    for start in range(0, len(transforms), AT_ONCE):
        x, y, turn = transforms[start : start + AT_ONCE].T
        c, s = np.cos(turn), np.sin(turn)
        back = np.column_stack([-c * x - s * y, s * x - c * y, -turn])
        forward = _worth_of(other, reference, transforms[start : start + AT_ONCE], most, worth)
        backward = _worth_of(reference, other, back, most, worth)
        scores[start : start + AT_ONCE] = (forward + backward) / 2
    return scores


def mutual_scores(
    reference: ScoredMap, other: ScoredMap, transforms: FloatArray, most: int, worth: Float32Array
) -> FloatArray:
    """Return (k,) what the walls of each map are worth in the other, the mean of both [m].

    Parameters
    ----------
    transforms
        (k, 3) from `other` to `reference` [m, m, rad], angles within a few turns.
    most
        Samples of a map, each of which stands for those between.
    worth
        (codes, directions) what a metre is worth in a cell, by the sample's turned direction; of
        directions a power of two.

    Raises
    ------
    ValueError
        Where lengths do not agree or a code is out of range.
    """
    if COMPILED is None:
        return mutual_scores_numpy(reference, other, transforms, most, worth)
    scores = COMPILED.mutual_scores(*reference, *other, transforms, most, worth)
    return cast("FloatArray", scores)


def _worth_of(
    walls: ScoredMap, there: ScoredMap, transforms: FloatArray, most: int, worth: Float32Array
) -> FloatArray:
    """(k,) what `walls` are worth where (k, 3) `transforms` lay them in the map `there`."""
    stride = 1 + max(len(walls.weight) - 1, 0) // most
    directions, (rows, columns) = worth.shape[1], there.codes.shape
    x, y = (walls.points[::stride] / there.cell).astype(np.float32).T
    looks = ((walls.facing[::stride] + TURNS) * directions).astype(np.float32)
    angle = transforms[:, 2, None].astype(np.float32)
    turn = angle * np.float32(directions / (2 * np.pi))
    c, s = (f(angle.astype(np.float64)).astype(np.float32) for f in (np.cos, np.sin))
    x0, y0 = ((transforms[:, :2] - there.origin) / there.cell).astype(np.float32).T[..., None]
    i = np.clip(c * x - s * y + x0, 0, rows - 1).astype(np.int32)
    j = np.clip(s * x + c * y + y0, 0, columns - 1).astype(np.int32)
    found = worth[there.codes[i, j], (looks + turn).astype(np.int32) & (directions - 1)]
    few = walls.weight[::stride]
    few = few * (walls.weight.sum() / max(few.sum(), 1e-300))
    counted = np.where(found < 0, walls.missing[::stride], 1.0) * found
    return np.asarray(counted @ few, dtype=np.float64)
