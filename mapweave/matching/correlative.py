"""Exhaustive search for a scan's pose in a window: coarse, and blind to no hypothesis.

Shapes need shape: in clutter, or where only a stub of wall is shared, what decides is how many
returns fall on what was seen before. A window of motions that a robot can make between two scans
is small enough to score every one of them, on a raster of nearness.
"""

from dataclasses import dataclass

import numpy as np
from pydantic import Field

from mapweave.geometry import se2
from mapweave.geometry.arrays import Float32Array, FloatArray
from mapweave.kernels.correlative import nearness_field, window_scores
from mapweave.parameters import StageParameters, derived


class CorrelativeParameters(StageParameters):
    """The window of motions and its resolution."""

    half_width: float = Field(14.0, gt=0, description="[m] of the raster about its centre")
    cell: float = derived(lambda c: c.mapping.resolution, gt=0, description="[m] of the raster")
    nearness: float = Field(
        0.15, gt=0, description="[m] standard deviation of the nearness kernel: half a step"
    )
    reach: float = derived(
        lambda c: min(10.0, 0.2 + 0.5 * c.robot.max_speed * c.sensor.interval),
        gt=0,
        description="[m] of translation, each way: half of what is driven, and a step; beyond 10 m"
        " little of the raster is left to compare with",
    )
    step: float = Field(0.2, gt=0, description="[m] between translations")
    turn_step: float = Field(0.052, gt=0, description="[rad] between rotations: 3 degrees")
    max_points: int = Field(120, ge=10, description="scan points that vote")
    candidates: int = Field(6, ge=1, description="how many different maxima are handed on")
    most_candidates: int = Field(30, ge=1, description="of a window that is wider than usual")

    def candidates_in(self, reach: float) -> int:
        """Return how many maxima of a window of `reach` [m] are handed on: as many to its area.

        A wider one has more look-alikes, which crowd out the true pose.
        """
        many = round(self.candidates * max(1.0, reach / self.reach) ** 2)
        return min(many, max(self.candidates, self.most_candidates))


@dataclass(frozen=True, slots=True, eq=False)
class LikelihoodField:
    """How near each place is to a known surface.

    Attributes
    ----------
    origin
        (2,) the raster's corner [m].
    centre
        (2,) its middle [m].
    cell
        [m].
    value
        (n + 1, n + 1) nearness in [0, 1]; the last row and column stand for everything outside: 0.
    """

    origin: FloatArray
    centre: FloatArray
    cell: float
    value: Float32Array

    @classmethod
    def of(
        cls, points: FloatArray, centre: FloatArray, p: CorrelativeParameters
    ) -> "LikelihoodField":
        """Rasterise (n, 2) `points` [m] in a square about `centre` (2,)."""
        origin = centre - p.half_width
        size = round(2 * p.half_width / p.cell)
        value = nearness_field(points, origin, p.cell, size, p.nearness)
        return cls(origin, centre.copy(), p.cell, value)


def search(
    points: FloatArray,
    raster: LikelihoodField,
    centre: FloatArray,
    max_turn: float,
    parameters: CorrelativeParameters,
) -> FloatArray:
    """Return the (k, 3) best poses for (n, 2) `points`, best first, all clearly different.

    Parameters
    ----------
    centre
        (3,) the middle of the window, raster frame.
    max_turn
        [rad] half the window's rotation; pi searches all.
    """
    p = parameters
    if len(points) > p.max_points:
        points = points[np.linspace(0, len(points) - 1, p.max_points).astype(np.int64)]
    turns = centre[2] + np.arange(-max_turn, max_turn + 1e-9, p.turn_step)
    count = round(p.reach / p.step)
    shifts = np.arange(-count, count + 1) * p.step
    scores = window_scores(
        np.ascontiguousarray(points),
        raster.value,
        raster.origin,
        raster.cell,
        turns,
        centre[:2] + shifts[:, None],
    )
    return np.array(
        [
            [centre[0] + shifts[i], centre[1] + shifts[j], se2.wrap(turns[k])]
            for k, i, j in _separate_maxima(scores, p.candidates)
        ]
    )


def _separate_maxima(scores: Float32Array, count: int) -> list[tuple[int, int, int]]:
    """Indices of the highest scores, each at least 4 turns or 3 shifts from the better ones.

    What is in `scores` is lost.
    """
    highest = scores.max(axis=(1, 2))  # of each turn: few of them change from one to the next
    found: list[tuple[int, int, int]] = []
    for _ in range(count):
        k = int(highest.argmax())
        i, j = (int(v) for v in np.unravel_index(int(scores[k].argmax()), scores.shape[1:]))
        found.append((k, i, j))
        near = scores[max(0, k - 3) : k + 4]
        near[:, max(0, i - 2) : i + 3, max(0, j - 2) : j + 3] = -1
        highest[max(0, k - 3) : k + 4] = near.max(axis=(1, 2))
    return found
