"""Walls of a stored joint map, joined once more: they stay as they are.

They were chosen of all that was seen, at a price that goes by it. What was seen is gone, and they
are few; chosen again they would be fewer each time, and at another price. So they go first, and
only what they leave unexplained makes walls.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mapweave.geometry.arrays import BoolArray, FloatArray, IntArray
from mapweave.geometry.segments import lengths
from mapweave.lines.simplification import SimplificationParameters, unexplained


@dataclass(frozen=True, slots=True, eq=False)
class Seen:
    """Walls as the pieces that are joined have them, in the frame of what they become.

    Attributes
    ----------
    segments
        (n, 4) [m].
    support
        (n,) how many scans saw each.
    sure
        (n,) how sure each was when it was joined before; NaN of what was only mapped.
    view
        (n,) the place of its component among those that are joined.
    piece
        (n,) the place of its piece among all of them.
    """

    segments: FloatArray
    support: IntArray
    sure: FloatArray
    view: IntArray
    piece: IntArray

    def those(self, kept: BoolArray) -> "Seen":
        """Return those walls that are `kept` (n,)."""
        return Seen(
            self.segments[kept],
            self.support[kept],
            self.sure[kept],
            self.view[kept],
            self.piece[kept],
        )

    @property
    def share(self) -> FloatArray:
        """(n,) of what was said of each wall when it was joined that confirmed it; 1 if mapped."""
        known = np.maximum(self.support, 1)
        return np.where(np.isnan(self.sure), 1.0, np.minimum(self.sure * (known + 1) / known, 1.0))


def staying(seen: Seen, parameters: SimplificationParameters) -> BoolArray:
    """Return (n,) which walls stay: those of the largest joint map, and what others have beyond.

    Of a wall that is known already a further one is a sighting.
    """
    stays = np.zeros(len(seen.segments), dtype=np.bool_)
    for number in _largest_first(seen):
        own = np.flatnonzero(seen.piece == number)
        if stays.any():
            own = own[unexplained(seen.segments[stays], seen.segments[own], parameters)]
        stays[own] = True
    return stays


def _largest_first(seen: Seen) -> Sequence[int]:
    """Return the pieces that were joined before, that of the most wall first."""
    wall = np.bincount(seen.piece, lengths(seen.segments))
    joined = np.unique(seen.piece[~np.isnan(seen.sure)])
    found: list[int] = joined[np.argsort(-wall[joined], kind="stable")].tolist()
    return found
