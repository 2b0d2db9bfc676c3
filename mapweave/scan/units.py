"""Distances in another unit than metres: told, as such a scan shows nothing and would say nothing.

What is in millimetres lies beyond what a lidar sees, and beyond the maximum where that is stated in
metres: a robot would seem to be blind. The maximum itself tells nothing: who sets it low cuts off
distances that are in metres.
"""

import numpy as np

from mapweave.errors import ArgumentError
from mapweave.geometry.arrays import FloatArray

FARTHEST = 100.0  # [m] at which nearly all that a lidar sees is never
NEARLY_ALL = 0.9  # of what is no sign of no return; some noise is near whatever the unit
SEEN = 0.5  # of all beams
DIFFERENT = 20  # distances; what did not come back is written as one number, or a few


def check_metres(ranges: FloatArray) -> None:
    """Raise ArgumentError if `ranges` (n,) are distances, but not in metres."""
    told = ranges[(ranges > 0) & (ranges < np.inf)]
    far = told[told > FARTHEST]
    if len(far) < max(NEARLY_ALL * len(told), SEEN * ranges.size, DIFFERENT):
        return
    if len(np.unique(far)) >= DIFFERENT:
        raise ArgumentError(
            "ranges",
            f"expected distances [m], got {np.median(far):.0f} at the median: are they in"
            " millimetres?",
        )
