"""How well determined a pose is, per direction: what ICP held it by, in metres and radians.

Along a corridor's walls nothing holds a scan; across them they do. The error that is told is that
of a scan against what was mapped lately, and what adds up where nothing holds it; see `Drift`.
"""

import math

import numpy as np
from pydantic import Field

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.geometry.ellipses import ellipse
from mapweave.parameters import StageParameters, derived

EXACT: FloatArray = np.zeros(4)
"""Of a pose that was given and not found, as that of the scan that defines the frame."""
EXACT.setflags(write=False)


class PoseCovarianceParameters(StageParameters):
    """What one point is worth, and what many of them are not."""

    noise: float = derived(
        lambda c: c.sensor.residual_sigma,
        gt=0,
        description="[m] of one point's residual, as in ICP: above the sensor's, because"
        " neighbouring returns err alike",
    )
    floor: float = Field(
        0.01, ge=0, description="[m] of what it was aligned to, however many points agree"
    )
    turn_floor: float = Field(0.002, ge=0, description="[rad] the same for the heading")
    step: float = Field(
        0.5, gt=0, description="[m] where nothing holds it: that of a step, as in tracking"
    )
    turn: float = Field(0.35, gt=0, description="[rad] the same for the turn, as in tracking")


def pose_uncertainty(
    information: FloatArray,
    parameters: PoseCovarianceParameters | None = None,
    drift: FloatArray | None = None,
) -> FloatArray:
    """Return (4,) standard deviations of a pose, and where the weakest points.

    Parameters
    ----------
    information
        (3, 3) of `Fit`: x, y and heading in units of one point, any frame. All zero where
        nothing was aligned, as for the scan that defines the frame: then it is `EXACT`.
    drift
        (3, 3) covariance of what it was aligned to, same frame; see `Drift`.

    Returns
    -------
    uncertainty
        Of the position in the direction that is held least [m], and across it [m]; of the
        heading [rad]; and that direction in the frame of `information` [rad], in (-pi/2, pi/2].
    """
    if not information.any():
        return EXACT
    p = parameters or PoseCovarianceParameters()
    xx, xy, yy, turn = _covariance(information, p)
    spread = np.array([[xx + p.floor**2, xy], [xy, yy + p.floor**2]])
    if drift is not None:
        spread, turn = spread + drift[:2, :2], turn + float(drift[2, 2])
    across, along, least = ellipse(spread)
    return np.array(
        [math.sqrt(along), math.sqrt(across), math.hypot(turn**0.5, p.turn_floor), least]
    )


def _covariance(
    information: FloatArray, p: PoseCovarianceParameters
) -> tuple[float, float, float, float]:
    """Return what `information` and steps as they are leave open: xx, xy, yy, and of the turn.

    The inverse of the sum, by cofactors in plain floats, at every scan.
    """
    (xx, xy, xt), (_, yy, yt), (_, _, tt) = (information / p.noise**2).tolist()
    xx, yy, tt = xx + p.step**-2, yy + p.step**-2, tt + p.turn**-2
    first, second, third = yy * tt - yt * yt, xt * yt - xy * tt, xy * yt - xt * yy
    whole = xx * first + xy * second + xt * third
    return first / whole, second / whole, (xx * tt - xt * xt) / whole, (xx * yy - xy * xy) / whole


def turn_uncertainty(uncertainty: FloatArray, angle: float) -> FloatArray:
    """Return (..., 4) `uncertainty` in a frame in which its own is turned by `angle` [rad]."""
    if uncertainty.ndim == 1:
        along, across, turn, direction = uncertainty.tolist()
        return np.array(
            [along, across, turn, math.remainder(2 * (direction + angle), 2 * math.pi) / 2]
        )
    turned = np.array(uncertainty, dtype=float)
    turned[..., 3] = _undirected(turned[..., 3] + angle)
    return turned


def _undirected(angle: FloatArray | float) -> FloatArray:
    """A line's direction in (-pi/2, pi/2]: it is the same both ways."""
    return se2.wrap(2 * np.asarray(angle)) / 2
