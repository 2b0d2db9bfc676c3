"""Where a scan may be along the direction that its walls leave open: in a corridor."""

import numpy as np

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.mapping.tracking.acceptance import ScanMatch


def slide_starts(
    tracked: ScanMatch,
    last: FloatArray,
    way: tuple[float, float],
    reach: float,
    step: float,
) -> FloatArray:
    """Return the (k, 3) poses along the direction that holds `tracked` least, and the usual one.

    Parameters
    ----------
    last
        (3,) where the robot was at the scan before.
    way
        [m] that it usually goes with such a turn, in the frame at `last`.
    reach, step
        [m] each way from `last`, and between two of them.
    """
    along, across = np.linalg.eigh(tracked.information[:2, :2])[1].T
    usual = se2.rotation(last[2]) @ way @ along
    count = round(reach / step)
    steps = np.append(np.arange(-count, count + 1) * step, usual)
    aside = across @ (tracked.pose - last)[:2]
    at = last[:2] + steps[:, None] * along + aside * across
    return np.column_stack([at, np.full(len(at), tracked.pose[2])])
