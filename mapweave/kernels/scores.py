"""What the samples of one map find in the cells of another, at many transforms."""

from typing import cast

import numpy as np
from numpy.typing import NDArray

from mapweave.kernels.arrays import Float32Array, FloatArray
from mapweave.kernels.loading import COMPILED

Codes = NDArray[np.uint8]
TURNS = 4  # added to directions, so that turned ones are above 0


def look_up_scores_numpy(
    points: FloatArray,
    facing: FloatArray,
    weight: FloatArray,
    missing: FloatArray,
    stride: int,
    motions: Float32Array,
    cell: float,
    codes: Codes,
    worth: Float32Array,
) -> FloatArray:
    """Twin of `look_up_scores`."""
    directions, (rows, columns) = worth.shape[1], codes.shape
    x, y = (points[::stride] / cell).astype(np.float32).T
    looks = ((facing[::stride] + TURNS) * directions).astype(np.float32)
    c, s, x0, y0, turn = (motion[:, None] for motion in motions.T)
    i = np.clip(c * x - s * y + x0, 0, rows - 1).astype(np.int32)
    j = np.clip(s * x + c * y + y0, 0, columns - 1).astype(np.int32)
    found = worth[codes[i, j], (looks + turn).astype(np.int32) & (directions - 1)]
    few = weight[::stride] * (weight.sum() / max(weight[::stride].sum(), 1e-300))
    counted = np.where(found < 0, missing[::stride], 1.0) * found
    return np.asarray(counted @ few, dtype=np.float64)


def look_up_scores(
    points: FloatArray,
    facing: FloatArray,
    weight: FloatArray,
    missing: FloatArray,
    stride: int,
    motions: Float32Array,
    cell: float,
    codes: Codes,
    worth: Float32Array,
) -> FloatArray:
    """Return (k,) what the samples are worth at each motion, each times its weight.

    Parameters
    ----------
    points, facing
        (n, 2) samples [m], and (n,) where they face, in [0, 1) turns.
    weight
        (n,) [m] of wall that each stands for.
    missing
        (n,) times what it is worth, where that is below 0.
    stride
        Each such sample is looked up, and stands for those between.
    motions
        (k, 5) cosine and sine of the turn, the shift [cells, cells] and the turn [directions].
        Turned directions are above 0.
    cell
        [m].
    codes
        (rows, columns) which row of `worth` a cell is worth: beyond the rim, what the rim says.
    worth
        (codes, directions) what a cell is worth for a sample, by the sample's turned direction; of
        directions a power of two.

    Raises
    ------
    ValueError
        Where lengths do not agree or a code is out of range.
    """
    compute = look_up_scores_numpy if COMPILED is None else COMPILED.look_up_scores
    asked = points, facing, weight, missing, stride, motions, cell, codes, worth
    return cast("FloatArray", compute(*asked))
