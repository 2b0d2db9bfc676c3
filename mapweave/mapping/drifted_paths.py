"""Paths of submaps that had drifted before: how far, and what a closed loop takes back."""

from dataclasses import replace

import numpy as np

from mapweave.geometry.arrays import FloatArray
from mapweave.maps import Trajectory

SURE = 0.1  # [m], [rad] that no scan errs by that something holds
FOUND_AGAIN = np.array([0.1, 0.1, 0.01, np.inf])  # as well as submaps that are joined are known


def carried(path: Trajectory) -> float:
    """Return how far [m] a robot had drifted, at the least, at each scan of a `path`."""
    held = path.uncertainty
    return 0.0 if held is None or len(held) == 0 else float(held[:, :3:2].max(axis=1).min())


def is_near(path: Trajectory, far: float, turned: float) -> bool:
    """Whether all of a `path` is most likely within `far` [m] and `turned` [rad] of the truth.

    What had drifted farther is not where a closed loop looked for it: a look-alike may be.
    """
    held = path.uncertainty
    return held is None or bool((2 * held[:, :3:2] <= (far, turned)).all())


def found_again(path: Trajectory) -> Trajectory:
    """Return a `path` that was found again in a map that had not drifted: it had not, either."""
    if carried(path) <= SURE or path.uncertainty is None:
        return path
    return replace(path, uncertainty=np.minimum(path.uncertainty, FOUND_AGAIN))


def beyond(sigmas: FloatArray, most: float) -> FloatArray:
    """(n,) `sigmas` of scans, `most` at the most, without what all of them had drifted before.

    That moves a submap as a whole.
    """
    counted = np.minimum(sigmas, most)
    least = counted.min()
    if least <= SURE:
        return np.asarray(counted)
    return np.asarray(np.sqrt(counted**2 - least**2 + SURE**2))
