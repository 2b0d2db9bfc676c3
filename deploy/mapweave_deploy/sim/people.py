"""People about a robot: they walk with it, or pass it while it stands.

A person is a trunk or two legs, depending on the height of the lidar; the legs swing.
"""

import numpy as np
import shapely
from numpy.random import Generator
from pydantic import BaseModel, ConfigDict, Field
from scipy import ndimage

from mapweave.geometry.arrays import FloatArray
from mapweave_deploy.sim.trajectories import Tour
from mapweave_deploy.sim.world import World, disc, line_segments

GAP = 0.02  # [m] no person stands nearer to a wall than its own width and this


class PeopleParameters(BaseModel):
    """Who is about, and how they walk."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    along: int = Field(0, ge=0)  # people who walk with the robot
    passing: int = Field(0, ge=0)  # people who go to and fro where the robot is
    nearest: float = Field(0.6, gt=0)  # [m] to the robot
    farthest: float = Field(2.5, gt=0)  # [m]
    pace: float = Field(1.2, gt=0)  # [m/s] of those who pass
    trunk: float = Field(0.2, gt=0)  # [m] radius
    leg: float = Field(0.07, gt=0)  # [m] radius
    stride: float = Field(0.6, gt=0)  # [m]


def people_at(
    world: World, tour: Tour, parameters: PeopleParameters, rng: Generator
) -> list[FloatArray]:
    """Return for each scan of `tour` the (k, 4) faces [m] of the people there then."""
    p = parameters
    walks = [_with_robot(world, tour, p, rng) for _ in range(p.along)]
    walks += [_past_robot(tour, p, rng) for _ in range(p.passing)]
    faces: list[list[FloatArray]] = [[np.empty((0, 4))] for _ in tour.stamp]
    for walk in walks:
        has_legs = bool(rng.random() < 0.5)
        for there, rounds in zip(faces, _rounds(walk, has_legs, p), strict=True):
            there += [_faces(*each) for each in rounds if _is_free(world, *each)]
    return [np.concatenate(there) for there in faces]


def _with_robot(world: World, tour: Tour, p: PeopleParameters, rng: Generator) -> FloatArray:
    """(m, 2) where somebody is who keeps beside, ahead of or behind the robot, more or less."""
    seconds = np.diff(tour.stamp, prepend=tour.stamp[0])
    usual = float(np.median(seconds[1:])) if len(seconds) > 1 else 1.0
    drift = ndimage.gaussian_filter1d(rng.normal(size=(len(tour.stamp), 2)), 4 / usual, axis=0)
    drift *= 0.4 / max(float(drift.std()), 1e-9)
    bearing = rng.uniform(-np.pi, np.pi) + drift[:, 0]
    middle = (p.nearest + p.farthest) / 2
    away = np.clip(middle + middle * drift[:, 1], p.nearest, p.farthest)
    angle = tour.pose[:, 2] + bearing
    offset = np.column_stack([np.cos(angle), np.sin(angle)])
    # Who has no room beside the robot comes nearer.
    shares = np.linspace(1, p.nearest / p.farthest, 8)
    places = tour.pose[:, None, :2] + (away[:, None] * shares)[..., None] * offset[:, None]
    roomy = world.free.buffer(-p.trunk - GAP)
    shapely.prepare(roomy)
    free = shapely.contains_xy(roomy, places[..., 0], places[..., 1])
    free &= np.hypot(*(places - tour.pose[:, None, :2]).transpose(2, 0, 1)) >= p.nearest - 1e-9
    first = np.argmax(free, axis=1)
    chosen = places[np.arange(len(places)), first]
    return np.where(free.any(axis=1)[:, None], chosen, np.nan)


def _past_robot(tour: Tour, p: PeopleParameters, rng: Generator) -> FloatArray:
    """(m, 2) where somebody is who goes past where the robot is, turns, and comes back."""
    aside = rng.uniform(p.nearest, p.farthest) * rng.choice([-1, 1])
    direction, half = rng.uniform(-np.pi, np.pi), rng.uniform(2.5, 5.0)
    pace = p.pace * rng.uniform(0.6, 1.4)
    gone = np.mod(pace * tour.stamp + rng.uniform(0, 4 * half), 4 * half)
    along = np.where(gone < 2 * half, gone - half, 3 * half - gone)
    ahead = np.array([np.cos(direction), np.sin(direction)])
    return np.asarray(
        tour.pose[:, :2] + along[:, None] * ahead + aside * np.array([-ahead[1], ahead[0]])
    )


def _rounds(
    walk: FloatArray, has_legs: bool, p: PeopleParameters
) -> list[list[tuple[float, float, float]]]:
    """Return for each scan the discs x, y, radius [m] of somebody on a `walk` (m, 2)."""
    if not has_legs:
        return [[(x, y, p.trunk)] for x, y in walk.tolist()]
    step = np.diff(walk, axis=0, prepend=walk[:1])
    heading = np.arctan2(step[:, 1], step[:, 0])
    phase = 2 * np.pi * np.nancumsum(np.hypot(*step.T)) / (2 * p.stride)
    ahead = np.column_stack([np.cos(heading), np.sin(heading)])
    aside = np.column_stack([-ahead[:, 1], ahead[:, 0]])
    swing = 0.5 * p.stride * np.sin(phase)[:, None] * ahead
    left, right = walk + swing + 0.1 * aside, walk - swing - 0.1 * aside
    pairs = zip(left.tolist(), right.tolist(), strict=True)
    return [[(*one, p.leg), (*other, p.leg)] for one, other in pairs]


def _is_free(world: World, x: float, y: float, radius: float) -> bool:
    """Whether there is room for a disc."""
    if not np.isfinite(x + y):
        return False
    place = shapely.Point(x, y)
    return bool(world.free.contains(place) and world.free.boundary.distance(place) > radius + GAP)


def _faces(x: float, y: float, radius: float) -> FloatArray:
    """(12, 4) the faces of a disc [m], visible from outside."""
    return line_segments(shapely.orient_polygons(disc(x, y, radius), exterior_cw=True).boundary)
