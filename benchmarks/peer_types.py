"""What the peers of the fusion benchmark are given and what they answer: the types between them."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.logs import Log
from benchmarks.stretches import Part
from mapweave.geometry.arrays import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Grid:
    """An occupancy grid as an image: rows along y, columns along x.

    Attributes
    ----------
    image
        (rows, columns) grey: 0 wall, 254 seen free, 205 unknown.
    corner
        (2,) [m] the outer corner of pixel (0, 0), where x and y are least.
    cell
        [m] the side of a pixel.
    """

    image: NDArray[np.uint8]
    corner: FloatArray
    cell: float


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """A stretch of a log as its corrected poses show it, in the frame of its first pose.

    Attributes
    ----------
    name
        Such as ``intel 2/6``: that of the stretch.
    log
        Whose scans they are.
    walls
        (n, 2) returns under 12 m [m], one a cell of 5 cm.
    grid
        Walls, free space, unknown.
    cells
        (m, 2) of wall, as stretches have them: in the log's corrected frame [m].
    part
        The view as alignments are judged by: its frame in the log's, its `walls`.
    """

    name: str
    log: Log
    walls: FloatArray
    grid: Grid
    cells: FloatArray
    part: Part


@dataclass(frozen=True, slots=True, eq=False)
class Guess:
    """Where a peer thinks that one view is in another.

    Attributes
    ----------
    transform
        (3,) takes coordinates in the second view to coordinates in the first [m, m, rad].
    score
        How sure it is; in units of its own.
    """

    transform: FloatArray
    score: float


@dataclass(frozen=True, slots=True)
class Peer:
    """A way to fuse two maps that somebody might take instead of mapweave.

    Attributes
    ----------
    name
        For the table.
    threshold
        From which score on a guess is accepted, by the peer's own default.
    prepare
        Makes of one view what `match` needs, once.
    match
        Guesses from two prepared views; None where it finds nothing at all.
    """

    name: str
    threshold: float
    prepare: Callable[[View], Any]
    match: Callable[[Any, Any], Guess | None]
