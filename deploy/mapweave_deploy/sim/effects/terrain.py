"""A floor that is not level: a robot on a ramp or a sill looks at the floor or over the walls.

The floor rises along ramps and stays as high behind them; a sill is two short ones.
"""

from dataclasses import dataclass

import numpy as np

from mapweave.geometry.arrays import FloatArray

EYE = 0.3  # [m] of the lidar above the floor
WHEELBASE = 0.3  # [m]
STEP = 0.05  # [m] along a ray, at which the floor is asked


@dataclass(frozen=True, slots=True)
class Ramp:
    """The floor rises from `foot` to `head`, and to both sides of the line between them.

    Attributes
    ----------
    foot, head
        x, y [m].
    rise
        [m]; negative where the floor falls.
    """

    foot: tuple[float, float]
    head: tuple[float, float]
    rise: float

    def height(self, points: FloatArray) -> FloatArray:
        """Return (...,) how much higher `points` (..., 2) lie for it [m]."""
        foot, way = np.array(self.foot), np.subtract(self.head, self.foot)
        share = (points - foot) @ way / (way @ way)
        height: FloatArray = self.rise * np.clip(share, 0.0, 1.0)
        return height


@dataclass(frozen=True, slots=True)
class Terrain:
    """A floor with ramps; level where there are none."""

    ramps: tuple[Ramp, ...] = ()

    @property
    def is_level(self) -> bool:
        """Whether there is nothing to look at."""
        return not self.ramps

    def height(self, points: FloatArray) -> FloatArray:
        """Return (...,) how high the floor is at `points` (..., 2) [m]."""
        height: FloatArray = np.sum([ramp.height(points) for ramp in self.ramps], axis=0)
        return height

    def floor_ranges(self, pose: FloatArray, directions: FloatArray, farthest: float) -> FloatArray:
        """Return (n,) how far [m] rays from a robot at `pose` go until they meet the floor.

        Infinite where they do not; `directions` (n,) are in the world's frame [rad].
        """
        rays = np.column_stack([np.cos(directions), np.sin(directions)])
        away = np.arange(STEP, farthest, STEP)
        eye = self.height(pose[:2]) + EYE
        floor = self.height(pose[:2] + away[:, None, None] * rays)
        met = eye + away[:, None] * self._slopes(pose, rays) < floor
        first = np.argmax(met, axis=0)
        return np.where(met.any(axis=0), away[first], np.inf)

    def _slopes(self, pose: FloatArray, rays: FloatArray) -> FloatArray:
        """(n,) by how much a metre of each ray rises, as the robot stands on its wheels."""
        ahead = np.array([np.cos(pose[2]), np.sin(pose[2])])
        axes = np.stack([ahead, [-ahead[1], ahead[0]]])
        wheels = pose[:2] + WHEELBASE / 2 * np.stack([axes, -axes])
        tilt = (self.height(wheels[0]) - self.height(wheels[1])) / WHEELBASE
        slopes: FloatArray = rays @ axes.T @ tilt
        return slopes


LEVEL = Terrain()


def sill(x: float, y: float, turn: float, height: float = 0.02) -> tuple[Ramp, Ramp]:
    """Return a strip 8 cm wide, across the direction `turn` [rad] at (`x`, `y`) [m]."""
    ahead = np.array([np.cos(turn), np.sin(turn)])
    points = [
        (float(x + d * ahead[0]), float(y + d * ahead[1])) for d in (-0.04, -0.02, 0.02, 0.04)
    ]
    return Ramp(points[0], points[1], height), Ramp(points[2], points[3], -height)
