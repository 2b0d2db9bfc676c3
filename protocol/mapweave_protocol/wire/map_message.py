"""A robot's map as a message."""

from collections.abc import Sequence, Set
from functools import cached_property
from typing import ClassVar, Self

import numpy as np
from pydantic import Field, model_validator

from mapweave.maps import RobotMap, Submap
from mapweave_protocol.wire import packing
from mapweave_protocol.wire.budget import MIB, Budget
from mapweave_protocol.wire.geometry import (
    DIGEST_SIZE,
    MAX_BYTES,
    MAX_SUBMAPS,
    PackedSubmap,
)
from mapweave_protocol.wire.model import (
    WORLD_REACH,
    Count,
    Id,
    Message,
    Transform,
    WireModel,
    to_transform,
)

MAX_COMPONENT = 99_999


class Place(WireModel):
    """Where a submap lies, and which form of its geometry is meant."""

    id: int = Field(ge=0, lt=MAX_SUBMAPS)
    component: int = Field(ge=0, le=MAX_COMPONENT)
    pose: Transform
    digest: bytes


class MapMessage(Message):
    """A robot map, or what changed in it: the poses of all submaps, the geometry of some.

    Attributes
    ----------
    poses
        Packed rows of id, component, x, y [mm], theta [µrad], ids ascending.
    digests
        Of the geometry of every submap, one after the other: a receiver that missed a message
        sees that what it holds is not what is meant.
    submaps
        The geometry of those submaps that are new or changed; of all if `complete`.
    """

    format: ClassVar[str] = "mapweave/map-message/1"
    budget: ClassVar[Budget] = Budget(16 * MIB, 32 * MIB, 50_000)

    robot: Id
    boot: Id
    version: Count
    complete: bool
    poses: bytes = Field(max_length=MAX_BYTES)
    digests: bytes = Field(max_length=MAX_SUBMAPS * DIGEST_SIZE)
    submaps: tuple[PackedSubmap, ...] = Field(max_length=MAX_SUBMAPS)

    @classmethod
    def pack(cls, robot_map: RobotMap) -> Self:
        """Return the complete message of `robot_map`."""
        packed = [PackedSubmap.pack(submap) for submap in robot_map.submaps]
        return cls.of_packed(robot_map, packed, {submap.id for submap in packed})

    @classmethod
    def of_packed(
        cls, robot_map: RobotMap, packed: Sequence[PackedSubmap], include: Set[int]
    ) -> Self:
        """Return the message of `robot_map` with the geometry of the submaps `include`.

        Parameters
        ----------
        packed
            The geometry of all submaps of `robot_map`, in their order.
        """
        return cls(
            robot=robot_map.robot,
            boot=robot_map.boot,
            version=robot_map.version,
            complete=include == {submap.id for submap in packed},
            poses=_pack_poses(robot_map.submaps),
            digests=b"".join(submap.digest for submap in packed),
            submaps=tuple(submap for submap in packed if submap.id in include),
        )

    @model_validator(mode="after")
    def _check(self) -> Self:
        meant = {place.id: place.digest for place in self.places}
        sent = {submap.id: submap.digest for submap in self.submaps}
        if list(sent) != sorted(sent) or len(sent) != len(self.submaps):
            raise ValueError("submaps, expected each once, ids ascending")
        if not sent.items() <= meant.items():
            raise ValueError("a submap without a place, or not the form that is meant")
        if self.complete and len(sent) < len(meant):
            raise ValueError("said to be complete, but submaps are missing")
        return self

    @cached_property
    def places(self) -> tuple[Place, ...]:
        """Where every submap of the map lies, ids ascending.

        Raises
        ------
        ValueError
            If the arrays do not fit each other.
        """
        rows = packing.unpack_integers(self.poses, 5, MAX_SUBMAPS)
        poses = packing.unquantise_poses(rows[:, 2:], WORLD_REACH)
        if len(self.digests) != len(rows) * DIGEST_SIZE:
            raise ValueError("digests, expected one for each submap")
        if np.any(np.diff(rows[:, 0]) <= 0):
            raise ValueError("submap ids, expected ascending")
        return tuple(
            Place(
                id=int(row[0]),
                component=int(row[1]),
                pose=to_transform(pose),
                digest=self.digests[k * DIGEST_SIZE : (k + 1) * DIGEST_SIZE],
            )
            for k, (row, pose) in enumerate(zip(rows, poses, strict=True))
        )


def _pack_poses(submaps: Sequence[Submap]) -> bytes:
    rows = np.array([[s.id, s.component] for s in submaps], dtype=np.int64).reshape(-1, 2)
    poses = np.array([s.pose for s in submaps]).reshape(-1, 3)
    return packing.pack_integers(np.hstack([rows, packing.quantise_poses(poses, WORLD_REACH)]))
