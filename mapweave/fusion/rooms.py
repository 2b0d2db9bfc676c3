"""Rooms: whether two maps agree about more than one room.

Rooms are built alike. Two maps that agree about all of one closed room agree about one thing,
however often it was driven through: the room may exist twice, and only what lies outside tells. A
plain corridor before it does not: it fits before every door.
"""

import math
from functools import reduce
from typing import NamedTuple

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray, IntArray
from mapweave.kernels.extent import longer_sides
from mapweave.kernels.matching.parts import nearest_parts
from mapweave.matching.distance_field import DistanceField
from mapweave.matching.verification import VerificationParameters, coinciding


class RoomParameters(BaseModel):
    """What a room is, and what one room alone proves."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    passage: float = Field(
        0.5,
        gt=0,
        description="[m] of free space to both sides of the middle of a passage that joins two"
        " parts of one room; less is a door, of which free space keeps 0.1 m to both sides",
    )
    coarse: int = Field(2, ge=1, description="cells of the raster in one that rooms are told by")
    max_extent: float = Field(
        9.0,
        gt=0,
        description="[m] a longer one is a corridor, a hall or a laboratory such as those of Intel,"
        " of 10 to 12 m, and seldom built twice; offices, classrooms and rooms of hotels are not",
    )
    min_outside: float = Field(
        4.0, ge=0, description="[m] of wall in common outside of the room that tell which it is"
    )
    one_way: float = Field(
        8.0,
        gt=0,
        description="metres that count for each that holds the weakest direction: a plain corridor"
        " before a room is as common as the room, and does not tell where along it that is",
    )
    of_rival: float = Field(
        0.5,
        gt=0,
        description="wall that the best has outside of one room, as a share of all that a rival"
        " has, from which a rival of one room is its twin: two thirds and more in generated"
        " buildings, a third where the rival is the right one",
    )
    clean: float = Field(
        0.99, gt=0, le=1, description="share in common of the best, at least, for that"
    )
    unique: float = Field(
        0.8, gt=0, le=1, description="probability that a room has no twin within reach of the team"
    )


class Rooms(NamedTuple):
    """What the free space of a map falls apart into where passages are closed.

    Attributes
    ----------
    nearest
        (rows, columns) the number of the room nearest to each coarse cell.
    extents
        (k,) the longer side of each, by how far it spreads [m].
    """

    nearest: IntArray
    extents: FloatArray


def outside(
    reference: DistanceField,
    other: DistanceField,
    transform: FloatArray,
    verification: VerificationParameters,
    parameters: RoomParameters,
    rooms: tuple[Rooms, Rooms] | None = None,
) -> float:
    """Return the metres of wall in common that tell the place when one room is left out.

    That room without which the least is left, by either map: one of them may have seen more through
    the door. Infinite where that is no room, but a corridor or a hall, by one of them: the other
    may have seen a part of it. A map that knows of no free space as wide as a passage tells of
    no room: the other one decides, and where neither tells, how far the wall in common spreads.

    Parameters
    ----------
    reference, other
        The two maps.
    transform
        (3,) from `other` to `reference` [m, m, rad].
    verification, parameters
        When walls coincide, and what a room is.
    rooms
        Of the two maps, where they were told before.
    """
    p, back = parameters, se2.inverse(transform)
    ours, theirs = rooms or (rooms_of(reference, p), rooms_of(other, p))
    both = (
        _outside(ours, reference, other, transform, verification, p),
        _outside(theirs, other, reference, back, verification, p),
    )
    told = [metres for metres in both if metres is not None]
    if not told:
        shared = coinciding(reference, other, transform, verification)
        points = other.oriented.points[shared]
        extent = longer_sides(points, np.zeros(len(points), dtype=np.int64), 1)[0]
        return 0.0 if extent <= p.max_extent else math.inf
    return math.inf if math.inf in told else min(told)


def _outside(
    rooms: Rooms,
    reference: DistanceField,
    other: DistanceField,
    transform: FloatArray,
    verification: VerificationParameters,
    p: RoomParameters,
) -> float | None:
    """Count by the `rooms` of `reference`; None where it tells of none."""
    nearest, extents = rooms
    if len(extents) == 0:
        return None
    shared = coinciding(reference, other, transform, verification)
    walls, weight = other.oriented.at(shared).moved(transform), other.weight[shared]
    # A wall is of the room that it faces.
    before = walls.points + p.passage * walls.normals
    cell = p.coarse * reference.cell
    index = np.floor((before - reference.origin) / cell).astype(np.int64)
    i, j = np.clip(index, 0, np.array(nearest.shape) - 1).T
    room = nearest[i, j]
    known = np.unique(room)
    if len(known) == 0:
        return 0.0
    left = [_telling(walls.normals, weight * (room != k), p) for k in known]
    decisive = int(np.argmin(left))
    return left[decisive] if extents[known[decisive]] <= p.max_extent else math.inf


def _telling(normals: FloatArray, weight: FloatArray, p: RoomParameters) -> float:
    """[m] of wall, no more than `one_way` times what holds the weakest direction of it."""
    held = np.linalg.eigvalsh((normals * weight[:, None]).T @ normals)[0]
    return float(min(weight.sum(), p.one_way * max(held, 0.0)))


def rooms_of(raster: DistanceField, p: RoomParameters) -> Rooms:
    """Return the rooms of a map: passages are closed that are no wider than a door."""
    rows, columns = (n // p.coarse for n in raster.depth.shape)
    cut, step = raster.depth[: rows * p.coarse, : columns * p.coarse], range(p.coarse)
    parts = [cut[i :: p.coarse, j :: p.coarse] for i in step for j in step]
    depth = reduce(np.maximum, parts)
    label, nearest = nearest_parts(depth > p.passage)
    count = int(label.max(initial=0))
    if count == 0:
        return Rooms(np.zeros((rows, columns), dtype=np.int64), np.empty(0))
    return Rooms(nearest - 1, _extents(label, count) * p.coarse * raster.cell + 2 * p.passage)


def _extents(label: IntArray, count: int) -> FloatArray:
    """(count,) longer sides [cells] of rectangles that spread as the parts of `label` do."""
    i, j = np.nonzero(label)
    part = label[i, j] - 1
    area = np.bincount(part, minlength=count)
    mean = [np.bincount(part, x, count) / area for x in (i, j)]
    u, v = i - mean[0][part], j - mean[1][part]
    uu, vv, uv = (np.bincount(part, x, count) / area for x in (u * u, v * v, u * v))
    greatest = (uu + vv) / 2 + np.hypot((uu - vv) / 2, uv)
    return np.asarray(np.sqrt(12 * greatest), dtype=np.float64)
