"""What a laser would see in a grid: so that a grid becomes lines by the means by which scans do."""

from collections.abc import Iterator

import numpy as np
import scipy
from pydantic import BaseModel, ConfigDict, Field

from mapweave.geometry.arrays import BoolArray, FloatArray, IntArray
from mapweave.mapping.grids.cells import GridCells
from mapweave.scan.scan import Scan

AT_ONCE = 64  # viewpoints whose beams are followed together: bounds the memory


class VirtualScanParameters(BaseModel):
    """Where the laser is set, and how it sees."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    spacing: float = Field(1.5, gt=0, description="[m] between places from which all is seen")
    close_by: float = Field(
        0.5, gt=0, description="[m] between those from which the rest is seen: niches, crannies"
    )
    near: float = Field(1.5, gt=0, description="[m] from what was not seen, there")
    beams: int = Field(720, ge=90, description="of a full turn")
    max_range: float = Field(8.0, gt=0, description="[m] beyond, beams are too far apart")
    unknown: float = Field(
        0.5, gt=0, description="[m] from free cells that a beam goes on: grids keep from walls"
    )


class VirtualLaser:
    """Set down here and there in a grid; its frame is that of the grid's corner."""

    def __init__(self, cells: GridCells, parameters: VirtualScanParameters) -> None:
        self._cells, self._p = cells, parameters
        to_free = scipy.ndimage.distance_transform_edt(~cells.free)
        out_of_sight = ~cells.wall & (to_free * cells.resolution > parameters.unknown)
        self._dense = _without_gaps(cells.wall)
        blocked = self._dense | out_of_sight
        # The rim stops every beam.
        blocked[[0, -1], :] = blocked[:, [0, -1]] = True
        self._clear: FloatArray = scipy.ndimage.distance_transform_edt(~blocked)
        self.seen: BoolArray = np.zeros_like(cells.wall)  # walls that the scans so far met

    def scans(self) -> Iterator[tuple[Scan, FloatArray]]:
        """Yield scans and their poses (3,) [m, m, rad]: of all that can be seen from somewhere."""
        everywhere = np.ones_like(self.seen)
        yield from self._numbered(self._places(everywhere, self._p.spacing), 0)
        reach = self._p.near / self._cells.resolution
        missed = self._cells.wall & ~self.seen
        if missed.any():
            about = scipy.ndimage.distance_transform_edt(~missed) <= reach
            count = len(self._places(everywhere, self._p.spacing))
            yield from self._numbered(self._places(about, self._p.close_by), count)

    def _places(self, where: BoolArray, spacing: float) -> IntArray:
        """(n, 2) row and column of free cells far from walls, one in each square of `spacing`."""
        size = max(1, round(spacing / self._cells.resolution))
        room = np.where(self._cells.free & where, self._clear, 0.0)
        rows, columns = (-(-n // size) for n in room.shape)
        padded = np.zeros((rows * size, columns * size))
        padded[: room.shape[0], : room.shape[1]] = room
        squares = padded.reshape(rows, size, columns, size).swapaxes(1, 2)
        flat = squares.reshape(rows, columns, -1)
        best, most = flat.argmax(axis=-1), flat.max(axis=-1)
        i, j = np.nonzero(most >= 2.0)  # [cells] a robot would not fit in less
        row, column = np.divmod(best[i, j], size)
        return np.column_stack([i * size + row, j * size + column])

    def _numbered(self, places: IntArray, first: int) -> Iterator[tuple[Scan, FloatArray]]:
        """Yield the scan from each of `places` (n, 2), and note which walls are seen."""
        angles = np.linspace(-np.pi, np.pi, self._p.beams, endpoint=False)
        for start in range(0, len(places), AT_ONCE):
            some = places[start : start + AT_ONCE]
            for k, (place, ranges) in enumerate(zip(some, self._cast(some, angles), strict=True)):
                x, y = (place[::-1] + 0.5) * self._cells.resolution
                yield Scan(ranges, angles, first + start + k), np.array([x, y, 0.0])

    def _cast(self, places: IntArray, angles: FloatArray) -> FloatArray:
        """(n, beams) ranges [m] from the middles of `places` (n, 2); NaN where nothing is met."""
        limit = self._p.max_range / self._cells.resolution
        along = np.stack([np.sin(angles), np.cos(angles)], axis=-1)  # row, column
        begin = places[:, None, :] + 0.5
        gone = np.zeros((len(places), len(angles)))  # [cells]
        going = np.ones(gone.shape, dtype=np.bool_)
        while going.any():
            at = np.floor(begin + gone[..., None] * along).astype(np.int64)
            room = self._clear[at[..., 0], at[..., 1]]
            going &= (room > 0) & (gone < limit)
            # Half a cell at the least; a cell's middle is half a diagonal from what is in it.
            gone += np.where(going, np.maximum(room - 1.5, 0.5), 0.0)
        met = self._dense[at[..., 0], at[..., 1]] & (gone < limit)
        _, nearest = self._cells.nearest_wall
        wall = nearest[:, at[..., 0], at[..., 1]]
        self.seen[wall[0][met], wall[1][met]] = True
        middle = np.moveaxis(wall, 0, -1) + 0.5 - begin
        ranges = (middle * along).sum(axis=-1) * self._cells.resolution
        return np.where(met & (ranges > 0), ranges, np.nan)


def _without_gaps(wall: BoolArray) -> BoolArray:
    """Return `wall` with the corners filled where cells touch by a corner only: beams pass none."""
    padded = np.pad(wall, 1)
    left, right = padded[1:-1, :-2], padded[1:-1, 2:]
    below, above = padded[:-2, 1:-1], padded[2:, 1:-1]
    return np.asarray(wall | ((left | right) & (below | above)))
