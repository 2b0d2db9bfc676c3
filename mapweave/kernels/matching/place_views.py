"""What maps say of transforms between them, by few samples and coarse cells.

Cheap enough for hundreds of candidates; what is best of them is judged finely elsewhere.
"""

from typing import Protocol, cast

import numpy as np
from numpy.typing import NDArray

from mapweave.kernels.arrays import FloatArray, IntArray
from mapweave.kernels.loading import COMPILED

Codes = NDArray[np.uint8]
Best = tuple[IntArray, FloatArray]


class PlaceView(Protocol):
    """A map as both the compiled class and its twin hold it; `place_view` makes one."""

    def mirrored(self, directions: int) -> "PlaceView":
        """Return the map as a sensor has it that hangs upside down: y is -y.

        Its cells tell so many `directions` apart; codes from that number on stay as they are.
        """


class PlaceViewNumpy:
    """Twin of the compiled class."""

    def __init__(
        self,
        codes: Codes,
        origin: FloatArray,
        cell: float,
        points: FloatArray,
        facing: FloatArray,
        metres: FloatArray,
    ) -> None:
        self.codes, self.origin, self.cell = codes, origin, cell
        self.samples = np.column_stack([points, facing, metres])

    def mirrored(self, directions: int) -> "PlaceViewNumpy":
        """See `PlaceView`."""
        codes = np.where(self.codes < directions, directions - 1 - self.codes, self.codes)
        origin = self.origin[0], -self.origin[1] - self.cell * codes.shape[1]
        points, (facing, metres) = self.samples[:, :2] * [1.0, -1.0], self.samples[:, 2:].T
        cells = np.ascontiguousarray(codes[:, ::-1]), np.array(origin), self.cell
        return PlaceViewNumpy(*cells, points, -facing % 1.0, metres)

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


def place_view(
    codes: Codes,
    origin: FloatArray,
    cell: float,
    points: FloatArray,
    facing: FloatArray,
    metres: FloatArray,
) -> PlaceView:
    """Hold a map ready.

    Parameters
    ----------
    codes
        (rows, columns) what each cell says: a row of the table it is scored by.
    origin
        (2,) the raster's corner, map frame [m].
    cell
        [m].
    points, facing, metres
        Of samples of its walls: (n, 2) [m]; (n,) where they face, in [0, 1) turns, and what they
        stand for [m].
    """
    make = PlaceViewNumpy if COMPILED is None else COMPILED.PlaceView
    return cast("PlaceView", make(codes, origin, cell, points, facing, metres))


class PlaceViews(Protocol):
    """The views of many maps, as both the compiled class and its twin hold them."""

    def add(self, view: PlaceView) -> int:
        """Take the view of one more map; return its slot, counted from 0."""

    def remove(self, slot: int) -> None:
        """Forget a view; its slot is not given again. ValueError if it has none."""

    def best(
        self,
        other: PlaceView,
        slots: IntArray,
        transforms: FloatArray,
        table: FloatArray,
        stride: int,
        kept: int,
        count: int,
    ) -> Best:
        """Return which of n places are best, at most `count`, and what both maps say of each.

        That is the mean of what the walls of each count in the other.

        Parameters
        ----------
        other
            The map that is looked for.
        slots, transforms
            (n,) the maps it may be in, (n, 3) the transforms to them [m, m, rad].
        table
            (codes, directions) what a metre of wall counts in a cell of each code, by its
            direction.
        stride
            Places are scored roughly first, by each such sample, which stands for those between.
        kept
            How many of them are scored by all samples, those best roughly.
        """


def place_views() -> PlaceViews:
    """Return a store of nothing."""
    make = PlaceViewsNumpy if COMPILED is None else COMPILED.PlaceViews
    return cast("PlaceViews", make())


class PlaceViewsNumpy:
    """Twin of the compiled class."""

    def __init__(self) -> None:
        self._views: list[PlaceViewNumpy | None] = []

    def add(self, view: PlaceViewNumpy) -> int:
        """See `PlaceViews`."""
        self._views.append(view)
        return len(self._views) - 1

    def remove(self, slot: int) -> None:
        """See `PlaceViews`."""
        self._at(slot)
        self._views[slot] = None

    def best(
        self,
        other: PlaceViewNumpy,
        slots: IntArray,
        transforms: FloatArray,
        table: FloatArray,
        stride: int,
        kept: int,
        count: int,
    ) -> Best:
        """See `PlaceViews`."""
        views = [self._at(slot) for slot in slots.tolist()]
        places = list(zip(views, transforms, strict=True))
        rough = np.array([_of_both(other, view, t, table, stride) for view, t in places])
        best = np.argsort(-rough, kind="stable")[:kept]
        closer = (places[k] for k in best.tolist())
        scores = np.array([_of_both(other, view, t, table, 1) for view, t in closer])
        ranked = np.argsort(-scores, kind="stable")[:count]
        return best[ranked], scores[ranked]

    def _at(self, slot: int) -> PlaceViewNumpy:
        view = self._views[slot] if 0 <= slot < len(self._views) else None
        if view is None:
            raise ValueError("slot: of a map expected")
        return view


def _of_both(
    other: PlaceViewNumpy, view: PlaceViewNumpy, t: FloatArray, table: FloatArray, stride: int
) -> float:
    """Return what `view` and `other` say of a transform (3,) between them, the mean of both."""
    c, s = np.cos(t[2]), np.sin(t[2])
    back = np.array([-c * t[0] - s * t[1], s * t[0] - c * t[1], -t[2]])
    both = view.worth(other, t, table, stride) + other.worth(view, back, table, stride)
    return stride * both / 2
