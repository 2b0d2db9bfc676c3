"""A ray-cast lidar with the failings of a real one.

Modelled on the Hokuyo UTM-30LX with its steps grouped by three: 270° in 361 beams of 0.75°,
30 m. A whole scan is taken at one instant; the robot's motion during a sweep is not simulated.
"""

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from pydantic import BaseModel, ConfigDict, Field

from mapweave.geometry.arrays import FloatArray, IntArray
from mapweave_deploy.sim.world import World


class LidarParameters(BaseModel):
    """What the lidar can do. Defaults: the Hokuyo UTM-30LX, its steps grouped by three."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    beams: int = Field(361, ge=2)  # evenly spread over the field of view
    field_of_view: float = Field(np.radians(270.0), gt=0, lt=2 * np.pi)  # [rad]
    maximum_range: float = Field(30.0, gt=0)  # [m], also what is reported when nothing came back
    noise: float = Field(0.015, ge=0)  # [m], standard deviation; data sheet: 0.01 m to 10 m
    dropout: float = Field(0.003, ge=0, le=1)  # share of readings lost without cause
    dark_return: float = Field(0.15, ge=0, le=1)  # share of readings that come back from glass
    grazing: float = Field(np.radians(3.0), ge=0)  # [rad], below this angle nothing comes back
    mixed: float = Field(0.15, ge=0, le=1)  # share of the readings at an edge that mix two surfaces
    edge: float = Field(0.3, gt=0)  # [m], a jump between neighbouring beams that makes an edge

    @property
    def angles(self) -> FloatArray:
        """(beams,) directions [rad], counter-clockwise."""
        return np.linspace(-self.field_of_view / 2, self.field_of_view / 2, self.beams)


@dataclass(frozen=True, slots=True, eq=False)
class Hits:
    """What each ray meets first.

    Attributes
    ----------
    range
        (n,) distance [m]; infinite where a ray meets nothing.
    wall
        (n,) row of the segment met; meaningless where it meets nothing.
    grazing
        (n,) angle between ray and surface [rad], 0 to pi/2.
    """

    range: FloatArray
    wall: IntArray
    grazing: FloatArray


def cast_rays(walls: FloatArray, origin: FloatArray, directions: FloatArray) -> Hits:
    """Return what rays from `origin` (2,) in `directions` (n,) [rad] meet among `walls` (m, 4).

    Only the visible side of a wall, its left, is ever met. The ray ``o + r d`` and the segment
    ``a + u (b - a)`` meet where ``r = cross(a - o, b - a) / cross(d, b - a)`` and
    ``u = cross(a - o, d) / cross(d, b - a)``; seen from the left both divisors are positive.
    """
    start, along = walls[:, :2] - origin, walls[:, 2:] - walls[:, :2]
    offset = start[:, 0] * along[:, 1] - start[:, 1] * along[:, 0]
    facing = np.flatnonzero(offset > 0)
    if len(facing) == 0:
        nothing = np.zeros(len(directions), dtype=np.int64)
        return Hits(np.full(len(directions), np.inf), nothing, np.zeros(len(directions)))
    start, along, offset = start[facing], along[facing], offset[facing]
    c, s = np.cos(directions), np.sin(directions)
    sine = np.outer(c, along[:, 1]) - np.outer(s, along[:, 0])
    share = np.outer(s, start[:, 0]) - np.outer(c, start[:, 1])
    met = (sine > 0) & (share >= 0) & (share <= sine)
    distance = np.divide(offset[None], sine, out=np.full(sine.shape, np.inf), where=met)
    first = np.argmin(distance, axis=1)
    rows = np.arange(len(directions))
    slope = sine[rows, first] / np.linalg.norm(along, axis=1)[first]
    return Hits(distance[rows, first], facing[first], np.arcsin(np.clip(slope, 0.0, 1.0)))


def measure(
    world: World, pose: FloatArray, parameters: LidarParameters, rng: Generator
) -> FloatArray:
    """Return the ranges (beams,) [m] seen from `pose` (3,); the maximum: nothing came back."""
    hits = cast_rays(world.walls, pose[:2], pose[2] + parameters.angles)
    ranges = _mix_edges(hits.range, parameters, rng)
    ranges = ranges + rng.normal(0.0, parameters.noise, size=len(ranges))
    lost = rng.random(len(ranges)) < parameters.dropout
    lost |= world.dark[hits.wall] & (rng.random(len(ranges)) > parameters.dark_return)
    lost |= hits.grazing < parameters.grazing
    lost |= ~(ranges < parameters.maximum_range)
    return np.where(lost, parameters.maximum_range, np.maximum(ranges, 0.02))


def _mix_edges(ranges: FloatArray, parameters: LidarParameters, rng: Generator) -> FloatArray:
    """Return `ranges`, some at an edge drawn towards the next beam's: the spot lies on both."""
    share = rng.random(len(ranges)) * (rng.random(len(ranges)) < parameters.mixed)
    following = np.append(ranges[1:], ranges[-1])
    with np.errstate(invalid="ignore"):  # two rays that meet nothing: no edge
        jump = following - ranges
    jump = np.where(np.isfinite(jump) & (np.abs(jump) > parameters.edge), jump, 0.0)
    return ranges + share * jump
