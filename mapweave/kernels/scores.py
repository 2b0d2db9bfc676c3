"""What the samples of one map find in the cells of another, at many transforms."""

from typing import cast

import numpy as np
from numpy.typing import NDArray

from mapweave.kernels.loading import COMPILED
from mapweave.kernels.point_map import Floats

Floats32 = NDArray[np.float32]
Codes = NDArray[np.uint8]


def look_up_scores_numpy(
    samples: Floats32,
    weight: Floats,
    motions: Floats32,
    codes: Codes,
    worth: Floats32,
    directions: int,
) -> Floats:
    """Twin of `look_up_scores`."""
    x, y, facing = samples.T
    c, s, x0, y0, turn = (motion[:, None] for motion in motions.T)
    rows, columns = codes.shape
    i = np.clip(c * x - s * y + x0, 0, rows - 1).astype(np.int32)
    j = np.clip(s * x + c * y + y0, 0, columns - 1).astype(np.int32)
    said = codes.ravel()[i * columns + j].astype(np.int64) * directions
    direction = (facing + turn).astype(np.int32) & (directions - 1)
    return np.asarray(worth[said + direction] @ weight, dtype=np.float64)


def look_up_scores(
    samples: Floats32,
    weight: Floats,
    motions: Floats32,
    codes: Codes,
    worth: Floats32,
    directions: int,
) -> Floats:
    """Return (k,) what the samples are worth at each motion, each times its weight.

    Parameters
    ----------
    samples
        (n, 3) place [cells, cells] and direction, of which there are `directions`, a power of two.
    weight
        (n,) of the samples.
    motions
        (k, 5) cosine and sine of the turn, the shift [cells, cells] and the turn [directions].
        Turned directions are above 0.
    codes
        (rows, columns) which row of `worth` a cell is worth: beyond the rim, what the rim says.
    worth
        Flat rows of what a cell is worth for a sample, by the sample's turned direction.

    Raises
    ------
    ValueError
        Where lengths do not agree or a code is out of range.
    """
    compute = look_up_scores_numpy if COMPILED is None else COMPILED.look_up_scores
    return cast("Floats", compute(samples, weight, motions, codes, worth, directions))
