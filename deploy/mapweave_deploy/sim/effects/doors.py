"""Doors that are shut and opened while a robot drives: leaves that swing about their hinges."""

import numpy as np
import shapely
from numpy.random import Generator
from pydantic import BaseModel, ConfigDict, Field

from mapweave.geometry.arrays import BoolArray, FloatArray
from mapweave_deploy.sim.trajectories import Tour
from mapweave_deploy.sim.world import World, box, line_segments

LEAF = 0.04  # [m] thick
GAP = 0.03  # [m] to the frame


class DoorParameters(BaseModel):
    """How doors are used."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    opened: float = Field(0.5, ge=0, le=1)  # share of the time
    spell: float = Field(15.0, gt=0)  # [s] for which a door stays as it is, at least
    near: float = Field(1.3, gt=0)  # [m] of a robot, who finds every door open
    swing: float = Field(np.radians(85.0), gt=0)  # [rad] of an open leaf


def doors_at(
    world: World, tour: Tour, parameters: DoorParameters, rng: Generator
) -> list[FloatArray]:
    """Return for each scan of `tour` the (k, 4) faces [m] of the leaves of all doors then."""
    faces: list[list[FloatArray]] = [[np.empty((0, 4))] for _ in tour.stamp]
    for door in world.doors:
        opened = _opened(door, tour, parameters, rng)
        shut, wide = _leaf(door, 0.0), _leaf(door, parameters.swing)
        for there, is_open in zip(faces, opened, strict=True):
            there.append(wide if is_open else shut)
    return [np.concatenate(there) for there in faces]


def _opened(door: FloatArray, tour: Tour, p: DoorParameters, rng: Generator) -> BoolArray:
    """(m,) whether a door is open at each scan."""
    spells = rng.random(int(tour.stamp[-1] / p.spell) + 2) < p.opened
    middle = (door[:2] + door[2:]) / 2
    near = np.hypot(*(tour.pose[:, :2] - middle).T) < p.near
    usual: BoolArray = spells[(tour.stamp / p.spell).astype(np.int64)]
    opened: BoolArray = usual | near
    return opened


def _leaf(door: FloatArray, swing: float) -> FloatArray:
    """(4, 4) faces of a leaf turned by `swing` [rad] about its hinge, visible from outside."""
    along = door[2:] - door[:2]
    turn = float(np.arctan2(along[1], along[0])) + swing
    width = float(np.hypot(*along)) - 2 * GAP
    middle = door[:2] + (GAP + width / 2) * np.array([np.cos(turn), np.sin(turn)])
    leaf = box(float(middle[0]), float(middle[1]), width, LEAF, turn)
    return line_segments(shapely.orient_polygons(leaf, exterior_cw=True).boundary)
