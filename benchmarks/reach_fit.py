"""How much maps are bent, as the joins of stretches tell: most likely parameters of `reach`."""

import numpy as np
from scipy.optimize import minimize

from benchmarks.logistic import MISTAKEN
from mapweave.geometry.arrays import FloatArray

ANYWHERE = 10.0  # [m] standard deviation along x and y of a mistaken outcome
LEAST = 0.001  # [m] off: nothing is exact, and the density of 0 is 0
START = (0.05, 0.01)


def fit_reach(reach: FloatArray, distance: FloatArray) -> tuple[float, float]:
    """Return (exact, bend) of `ExtrapolationParameters`.

    Errors are normal along x and along y, so their size is of Rayleigh's distribution; its scale
    grows with the reach. A few are mistaken and tell nothing, as the poses are that they are
    measured against.

    Parameters
    ----------
    reach
        (n,) how far the maps go on beyond what they share [m].
    distance
        (n,) how far off each join is at the median over the map [m].

    Raises
    ------
    ValueError
        If a number is not finite.
    RuntimeError
        If the search does not come to an end.
    """
    if not (np.isfinite(reach).all() and np.isfinite(distance).all()):
        raise ValueError("expected finite reaches and distances")
    off = np.maximum(distance, LEAST)

    def loss(logs: FloatArray) -> float:
        exact, bend = np.exp(logs)
        usual = _rayleigh(off, np.hypot(exact, bend * reach))
        odd = _rayleigh(off, np.full(len(off), ANYWHERE))
        return -float(np.log((1 - MISTAKEN) * usual + MISTAKEN * odd).sum())

    found = minimize(loss, np.log(START), method="Nelder-Mead", options={"maxiter": 2000})
    if not found.success:
        raise RuntimeError(f"how much maps are bent cannot be fitted: {found.message}")
    exact, bend = np.exp(found.x)
    return float(exact), float(bend)


def _rayleigh(distance: FloatArray, scale: FloatArray) -> FloatArray:
    squared = scale**2
    return np.asarray(distance / squared * np.exp(-(distance**2) / (2 * squared)))
