"""The parts of messages that hold geometry: submaps, lines, free space, trajectories, packed."""

from functools import cached_property
from hashlib import blake2b
from typing import Self

import msgpack
import numpy as np
from pydantic import Field, model_validator

from mapweave.geometry.arrays import BoolArray, FloatArray, IntArray
from mapweave.geometry.segments import lengths
from mapweave.maps import LineMap, Submap, Trajectory
from mapweave_protocol.wire import packing
from mapweave_protocol.wire.model import WireModel

SUBMAP_REACH = 1e3  # [m] from a submap's origin; submaps are some 20 m across
MAX_SUBMAPS = 4096  # of one robot: some 60 km of path
MAX_SEGMENTS = 200_000  # of one line map
MAX_VERTICES = 400_000  # of the free space of one line map
MAX_SCANS = 100_000  # of one submap
MAX_SUPPORT = 2**31
DIGEST_SIZE = 8  # [bytes]
MAX_BYTES = 8 * 2**20  # of one packed array
MAX_WALL = 100_000.0  # [m] of one line map; comparing maps takes time and memory by the metre


class PackedLines(WireModel):
    """A line map: segments by polyline, their support, and the free space."""

    segments: bytes = Field(max_length=MAX_BYTES)
    polyline_lengths: bytes = Field(max_length=MAX_BYTES)
    support: bytes = Field(max_length=MAX_BYTES)
    free_space: bytes = Field(max_length=MAX_BYTES)
    free_space_lengths: bytes = Field(max_length=MAX_BYTES)

    @classmethod
    def pack(cls, lines: LineMap, reach: float) -> Self:
        """Return `lines` packed; segments shorter than a millimetre vanish."""
        segments = packing.quantise(lines.segments, packing.PER_METRE, reach)
        kept = cls.kept(lines, reach)
        counts = _run_lengths(lines.polyline[kept])
        rings = [packing.quantise(ring, packing.PER_METRE, reach) for ring in lines.free_space]
        vertices = np.vstack([np.empty((0, 2), dtype=np.int64), *rings])
        return cls(
            segments=packing.pack_integers(segments[kept].reshape(-1, 2)),
            polyline_lengths=packing.pack_integers(counts[:, None]),
            support=packing.pack_integers(lines.support[kept, None]),
            free_space=packing.pack_integers(vertices),
            free_space_lengths=packing.pack_integers(
                np.array([len(ring) for ring in rings], dtype=np.int64)[:, None]
            ),
        )

    @staticmethod
    def kept(lines: LineMap, reach: float) -> BoolArray:
        """Return ``(n,)`` which segments of `lines` still have a length in whole millimetres."""
        segments = packing.quantise(lines.segments, packing.PER_METRE, reach)
        return np.asarray(np.any(segments[:, :2] != segments[:, 2:], axis=1))

    def unpack(self, reach: float) -> LineMap:
        """Return the line map.

        Raises
        ------
        ValueError
            If the arrays do not fit each other, or a coordinate is beyond `reach` [m].
        """
        segments = self._segments(reach)
        counts = packing.unpack_integers(self.polyline_lengths, 1, MAX_SEGMENTS)[:, 0]
        support = packing.unpack_integers(self.support, 1, MAX_SEGMENTS)[:, 0]
        _check_partition("polylines", counts, 1, len(segments))
        if len(support) != len(segments):
            raise ValueError(f"support of {len(support)} segments, expected {len(segments)}")
        if np.any((support < 0) | (support > MAX_SUPPORT)):
            raise ValueError(f"support, expected 0 to {MAX_SUPPORT}")
        polyline = np.repeat(np.arange(len(counts)), counts)
        return LineMap(segments, polyline, support, self._free_space(reach))

    def _segments(self, reach: float) -> FloatArray:
        points = packing.unpack_integers(self.segments, 2, 2 * MAX_SEGMENTS)
        if len(points) % 2:
            raise ValueError("a segment without an end")
        segments = packing.unquantise(points.reshape(-1, 4), packing.PER_METRE, reach)
        wall = float(lengths(segments).sum())
        if wall > MAX_WALL:
            raise ValueError(f"{wall:.0f} m of wall, expected at most {MAX_WALL:.0f} m")
        if np.any(np.all(segments[:, :2] == segments[:, 2:], axis=1)):
            raise ValueError("a segment without length")
        return segments

    def _free_space(self, reach: float) -> tuple[FloatArray, ...]:
        vertices = packing.unpack_integers(self.free_space, 2, MAX_VERTICES)
        counts = packing.unpack_integers(self.free_space_lengths, 1, MAX_VERTICES)[:, 0]
        _check_partition("free-space polygons", counts, 3, len(vertices))
        metres = packing.unquantise(vertices, packing.PER_METRE, reach)
        return tuple(np.split(metres, np.cumsum(counts)[:-1])) if len(counts) else ()


class PackedTrajectory(WireModel):
    """The poses of the scans of a submap."""

    scan_index: bytes = Field(max_length=MAX_BYTES)
    stamps: bytes = Field(max_length=MAX_BYTES)
    poses: bytes = Field(max_length=MAX_BYTES)

    @classmethod
    def pack(cls, trajectory: Trajectory) -> Self:
        """Return `trajectory` packed."""
        return cls(
            scan_index=packing.pack_integers(trajectory.scan_index[:, None]),
            stamps=packing.pack_integers(packing.quantise_stamps(trajectory.stamp)[:, None]),
            poses=packing.pack_integers(packing.quantise_poses(trajectory.pose, SUBMAP_REACH)),
        )

    def unpack(self) -> Trajectory:
        """Return the trajectory.

        Raises
        ------
        ValueError
            If the arrays do not fit each other, or a pose is out of reach.
        """
        index = packing.unpack_integers(self.scan_index, 1, MAX_SCANS)[:, 0]
        ticks = packing.unpack_integers(self.stamps, 1, MAX_SCANS)[:, 0]
        poses = packing.unpack_integers(self.poses, 3, MAX_SCANS)
        if not len(index) == len(ticks) == len(poses):
            raise ValueError("scan indices, stamps and poses, expected as many of each")
        if np.any(index < 0):
            raise ValueError("negative scan index")
        stamps = packing.unquantise_stamps(ticks)
        return Trajectory(index, stamps, packing.unquantise_poses(poses, SUBMAP_REACH))


class PackedSubmap(WireModel):
    """A submap without its pose and component, which travel with every message."""

    id: int = Field(ge=0, lt=MAX_SUBMAPS)
    lines: PackedLines
    trajectory: PackedTrajectory

    @classmethod
    def pack(cls, submap: Submap) -> Self:
        """Return the geometry of `submap` packed."""
        return cls(
            id=submap.id,
            lines=PackedLines.pack(submap.map, SUBMAP_REACH),
            trajectory=PackedTrajectory.pack(submap.trajectory),
        )

    @model_validator(mode="after")
    def _check(self) -> Self:
        self.lines.unpack(SUBMAP_REACH)
        self.trajectory.unpack()
        return self

    @cached_property
    def digest(self) -> bytes:
        """Tells apart the forms of a submap that still grows."""
        return blake2b(msgpack.packb(self.model_dump()), digest_size=DIGEST_SIZE).digest()

    def unpack(self, component: int, pose: FloatArray) -> Submap:
        """Return the submap, with the `component` and ``(3,)`` `pose` given apart."""
        lines = self.lines.unpack(SUBMAP_REACH)
        return Submap(self.id, component, pose, lines, self.trajectory.unpack())


def _run_lengths(labels: IntArray) -> IntArray:
    """Return how often each of the ascending ``(n,)`` `labels` occurs."""
    return np.unique(labels, return_counts=True)[1].astype(np.int64)


def _check_partition(what: str, counts: IntArray, least: int, total: int) -> None:
    if np.any((counts < least) | (counts > total)) or int(counts.sum()) != total:
        raise ValueError(f"{what}: expected lengths of at least {least} that add up to {total}")
