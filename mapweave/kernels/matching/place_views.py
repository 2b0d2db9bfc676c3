"""What maps say of transforms between them, by few samples and coarse cells.

Cheap enough for hundreds of candidates; what is best of them is judged finely elsewhere.
"""

from collections.abc import Sequence
from typing import Protocol, cast

import numpy as np
from numpy.typing import NDArray

from mapweave.kernels.arrays import FloatArray
from mapweave.kernels.loading import COMPILED

Codes = NDArray[np.uint8]


class PlaceView(Protocol):
    """A map as both the compiled class and its twin hold it; `place_view` makes one."""


class PlaceViewNumpy:
    """Twin of the compiled class."""

    def __init__(self, codes: Codes, origin: FloatArray, cell: float, samples: FloatArray) -> None:
        self.codes, self.origin, self.cell, self.samples = codes, origin, cell, samples

    def worth(
        self, other: "PlaceViewNumpy", pose: FloatArray, table: FloatArray, stride: int
    ) -> float:
        """Return what the walls of `other` count in this map, at the `pose` (3,) of it."""
        c, s = np.cos(pose[2]), np.sin(pose[2])
        x, y, facing, metres = other.samples[::stride].T
        placed = np.column_stack([c * x - s * y + pose[0], s * x + c * y + pose[1]])
        cells = np.floor((placed - self.origin) / self.cell).astype(np.int64)
        inside = np.all((cells >= 0) & (cells < self.codes.shape), axis=1)
        code = self.codes[tuple(cells[inside].T)]
        turn = ((facing + (pose[2] / (2 * np.pi) + 2)) * table.shape[1]).astype(np.int64)
        return float((metres[inside] * table[code, turn[inside] % table.shape[1]]).sum())


def place_view(codes: Codes, origin: FloatArray, cell: float, samples: FloatArray) -> PlaceView:
    """Hold a map ready.

    Parameters
    ----------
    codes
        (rows, columns) what each cell says: a row of the table it is scored by.
    origin
        (2,) the raster's corner, map frame [m].
    cell
        [m].
    samples
        (n, 4) of its walls: x, y [m], direction of the normal in [0, 1) turns, metres that it
        stands for.
    """
    make = PlaceViewNumpy if COMPILED is None else COMPILED.PlaceView
    return cast("PlaceView", make(codes, origin, cell, samples))


def score_views_numpy(
    other: PlaceViewNumpy,
    views: Sequence[PlaceViewNumpy],
    transforms: FloatArray,
    table: FloatArray,
    stride: int,
) -> FloatArray:
    """Twin of `score_views`."""
    scores = np.empty(len(views))
    for k, (view, t) in enumerate(zip(views, transforms, strict=True)):
        c, s = np.cos(t[2]), np.sin(t[2])
        back = np.array([-c * t[0] - s * t[1], s * t[0] - c * t[1], -t[2]])
        both = view.worth(other, t, table, stride) + other.worth(view, back, table, stride)
        scores[k] = stride * both / 2
    return scores


def score_views(
    other: PlaceView,
    views: Sequence[PlaceView],
    transforms: FloatArray,
    table: FloatArray,
    stride: int = 1,
) -> FloatArray:
    """Return (n,) what each of `views` and `other` say of transforms between them, their mean.

    Parameters
    ----------
    transforms
        (n, 3) from `other` to each view [m, m, rad].
    table
        (codes, directions) what a metre of wall counts in a cell of each code, by its direction.
    stride
        Which samples are looked up: each, every second and so on; those stand for the others.
    """
    if COMPILED is None:
        twins = cast("list[PlaceViewNumpy]", [other, *views])
        return score_views_numpy(twins[0], twins[1:], transforms, table, stride)
    return cast("FloatArray", COMPILED.score_views(other, list(views), transforms, table, stride))
