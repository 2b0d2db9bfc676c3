"""What a lidar sees of the robot that carries it: its trunk, the posts of a deck above, a wire."""

import numpy as np
from numpy.random import Generator
from pydantic import BaseModel, ConfigDict, Field

from mapweave.geometry.arrays import BoolArray, FloatArray


class OwnBodyParameters(BaseModel):
    """What of the robot is in view."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    width: float = Field(0.0, ge=0, lt=2 * np.pi)  # [rad] that the trunk hides
    middle: float = Field(np.pi, ge=-np.pi, le=np.pi)  # [rad] of the trunk: behind
    distance: float = Field(0.25, gt=0)  # [m] to the trunk's flat side
    posts: int = Field(0, ge=0)  # around the lidar, as those of a deck above it
    post_distance: float = Field(0.18, gt=0)  # [m]
    post_radius: float = Field(0.02, gt=0)  # [m]
    wires: int = Field(0, ge=0)  # of a beam or two each
    seen: float = Field(1.0, ge=0, le=1)  # share of the time that it is in view: an arm, a flap
    spell: int = Field(40, ge=1)  # scans for which it stays, or is away
    noise: float = Field(0.004, ge=0)  # [m], standard deviation


def body_ranges(angles: FloatArray, parameters: OwnBodyParameters, rng: Generator) -> FloatArray:
    """Return (n,) how far [m] the body is along each of `angles` (n,) [rad]; infinite beside it."""
    p = parameters
    beside = np.abs((angles - p.middle + np.pi) % (2 * np.pi) - np.pi)
    flat = p.distance / np.cos(np.minimum(beside, 1.1))
    ranges = np.where(beside < p.width / 2, flat, np.inf)
    for bearing in 0.6 + np.arange(p.posts) * 2 * np.pi / max(p.posts, 1):
        ranges = np.minimum(ranges, _thin(angles, bearing, p.post_distance, p.post_radius))
    for _ in range(p.wires):
        bearing, away = rng.uniform(-np.pi, np.pi), rng.uniform(0.08, 0.4)
        ranges = np.minimum(ranges, _thin(angles, bearing, away, 0.004))
    return ranges


def _thin(angles: FloatArray, bearing: float, away: float, radius: float) -> FloatArray:
    """(n,) [m] to something round of `radius` [m]; infinite beside it."""
    beside = np.abs((angles - bearing + np.pi) % (2 * np.pi) - np.pi)
    across = away * np.sin(np.minimum(beside, np.pi / 2))
    near = away * np.cos(beside) - np.sqrt(np.maximum(radius**2 - across**2, 0))
    return np.where((across < radius) & (beside < np.pi / 2), near, np.inf)


def in_view(count: int, parameters: OwnBodyParameters, rng: Generator) -> BoolArray:
    """(count,) whether the body is in view, for spells of some scans."""
    spells = rng.random(count // parameters.spell + 1) < parameters.seen
    return np.repeat(spells, parameters.spell)[:count]
