"""A ray-cast lidar with the failings of a real one.

Modelled on the Hokuyo UTM-30LX with its steps grouped by three: 270° in 361 beams of 0.75°,
30 m. A whole scan is taken at one instant; the robot's motion during a sweep is not simulated.
"""

from typing import Literal

import numpy as np
from numpy.random import Generator
from pydantic import BaseModel, ConfigDict, Field

from mapweave.geometry.arrays import FloatArray
from mapweave_deploy.sim.effects.panes import NO_WALL, look
from mapweave_deploy.sim.effects.rays import Hits, cast_rays
from mapweave_deploy.sim.world import World

Order = Literal["counter-clockwise", "clockwise", "mirrored"]


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
    order: Order = "counter-clockwise"  # of readings; mirrored: upside down, and nobody says so

    @property
    def angles(self) -> FloatArray:
        """(beams,) directions [rad], counter-clockwise."""
        return np.linspace(-self.field_of_view / 2, self.field_of_view / 2, self.beams)


def measure(
    world: World, pose: FloatArray, parameters: LidarParameters, rng: Generator
) -> FloatArray:
    """Return the ranges (beams,) [m] seen from `pose` (3,); the maximum: nothing came back."""
    hits = _hits(world, pose, parameters, rng)
    ranges = _mix_edges(hits.range, parameters, rng)
    ranges = ranges + rng.normal(0.0, parameters.noise, size=len(ranges))
    lost = rng.random(len(ranges)) < parameters.dropout
    dark = np.append(world.dark, False)[hits.wall]  # the last is for what is no wall
    lost |= dark & (rng.random(len(ranges)) > parameters.dark_return)
    lost |= hits.grazing < parameters.grazing
    lost |= ~(ranges < parameters.maximum_range)
    return np.where(lost, parameters.maximum_range, np.maximum(ranges, 0.02))


def _hits(world: World, pose: FloatArray, parameters: LidarParameters, rng: Generator) -> Hits:
    """Return what the beams meet first: walls, panes, or the floor."""
    directions = pose[2] + parameters.angles
    if len(world.glass) or len(world.mirrors):
        hits = look(world.walls, world.glass, world.mirrors, pose[:2], directions, rng)
    else:
        hits = cast_rays(world.walls, pose[:2], directions)
    if world.terrain.is_level:
        return hits
    floor = world.terrain.floor_ranges(pose, directions, parameters.maximum_range)
    below = floor < hits.range
    wall = np.where(below, NO_WALL, hits.wall)
    return Hits(np.minimum(floor, hits.range), wall, np.where(below, np.pi / 2, hits.grazing))


def _mix_edges(ranges: FloatArray, parameters: LidarParameters, rng: Generator) -> FloatArray:
    """Return `ranges`, some at an edge drawn towards the next beam's: the spot lies on both."""
    share = rng.random(len(ranges)) * (rng.random(len(ranges)) < parameters.mixed)
    following = np.append(ranges[1:], ranges[-1])
    with np.errstate(invalid="ignore"):  # two rays that meet nothing: no edge
        jump = following - ranges
    jump = np.where(np.isfinite(jump) & (np.abs(jump) > parameters.edge), jump, 0.0)
    return ranges + share * jump
