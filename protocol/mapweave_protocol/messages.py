"""The messages, and how they are made from and turned into the types of `mapweave.maps`.

A message that exists is valid: every length and number is checked when it is made, whether from
our own maps or from a stranger's bytes (`mapweave_protocol.codec`).
"""

from collections.abc import Iterable, Mapping
from typing import ClassVar, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from mapweave.arrays import FloatArray
from mapweave.maps import (
    Alignment,
    Decision,
    JointComponent,
    JointMap,
    RobotMap,
    Submap,
)
from mapweave_protocol import packing
from mapweave_protocol.geometry import (
    MAX_BYTES,
    MAX_SEGMENTS,
    MAX_SUBMAPS,
    WORLD_REACH,
    PackedLines,
    PackedSubmap,
)
from mapweave_protocol.model import (
    ComponentName,
    Count,
    Id,
    Label,
    Message,
    Number,
    Probability,
    WireModel,
)

MAX_COMPONENT = 99_999
MAX_ALIGNMENTS = 4096
MAX_EVIDENCE = 64
MAX_PEERS = 1024
Transform = tuple[Number, Number, Number]


class SubmapPose(WireModel):
    """Where a submap lies."""

    id: int = Field(ge=0, lt=MAX_SUBMAPS)
    component: int = Field(ge=0, le=MAX_COMPONENT)
    pose: Transform


class MapMessage(Message):
    """A robot map, or what changed in it: the poses of all submaps, the geometry of some.

    Attributes
    ----------
    poses
        Packed rows of id, component, x, y [mm], theta [µrad], ids ascending.
    submaps
        The geometry of those submaps that are new or changed; of all if `complete`.
    """

    format: ClassVar[str] = "mapweave/map-message/1"

    robot: Id
    boot: Id
    version: Count
    complete: bool
    poses: bytes = Field(max_length=MAX_BYTES)
    submaps: tuple[PackedSubmap, ...] = Field(max_length=MAX_SUBMAPS)

    @classmethod
    def pack(cls, robot_map: RobotMap, include: Iterable[int] | None = None) -> Self:
        """Return the message of `robot_map` with the geometry of the submaps `include`, or all."""
        wanted = None if include is None else set(include)
        chosen = [s for s in robot_map.submaps if wanted is None or s.id in wanted]
        return cls.from_packed(robot_map, [PackedSubmap.pack(submap) for submap in chosen])

    @classmethod
    def from_packed(cls, robot_map: RobotMap, submaps: Iterable[PackedSubmap]) -> Self:
        """Return the message of `robot_map` with the geometry `submaps`, already packed."""
        geometry = tuple(submaps)
        return cls(
            robot=robot_map.robot,
            boot=robot_map.boot,
            version=robot_map.version,
            complete=len(geometry) == len(robot_map.submaps),
            poses=_pack_poses(robot_map.submaps),
            submaps=geometry,
        )

    @model_validator(mode="after")
    def _check(self) -> Self:
        known = [place.id for place in self.places]
        sent = [submap.id for submap in self.submaps]
        if known != sorted(set(known)) or sent != sorted(set(sent)):
            raise ValueError("submap ids, expected each once, ascending")
        if not set(sent) <= set(known):
            raise ValueError("a submap without a pose")
        if self.complete and sent != known:
            raise ValueError("said to be complete, but submaps are missing")
        return self

    @property
    def places(self) -> list[SubmapPose]:
        """Where every submap of the map lies."""
        rows = packing.unpack_integers(self.poses, 5, MAX_SUBMAPS)
        poses = packing.unquantise_poses(rows[:, 2:], WORLD_REACH)
        return [
            SubmapPose(id=int(row[0]), component=int(row[1]), pose=_transform(pose))
            for row, pose in zip(rows, poses, strict=True)
        ]


def _pack_poses(submaps: tuple[Submap, ...]) -> bytes:
    rows = np.array([[s.id, s.component] for s in submaps], dtype=np.int64).reshape(-1, 2)
    poses = np.array([s.pose for s in submaps]).reshape(-1, 3)
    return packing.pack_integers(np.hstack([rows, packing.quantise_poses(poses, WORLD_REACH)]))


def _transform(pose: FloatArray) -> Transform:
    x, y, theta = (float(number) for number in pose)
    return x, y, theta


class MapVersion(WireModel):
    """Which state of which robot's map."""

    robot: Id
    boot: Id
    version: Count

    @classmethod
    def of(cls, robot_map: RobotMap) -> Self:
        """Return which state `robot_map` is."""
        return cls(robot=robot_map.robot, boot=robot_map.boot, version=robot_map.version)


class RunnerUp(WireModel):
    """The best different hypothesis."""

    transform: Transform
    numbers: dict[Label, Number] = Field(max_length=MAX_EVIDENCE)


class WireAlignment(WireModel):
    """An alignment of two components."""

    reference: ComponentName
    other: ComponentName
    transform: Transform
    decision: Decision
    confidence: Probability
    reason: str = Field(max_length=500)
    evidence: dict[Label, Number] = Field(max_length=MAX_EVIDENCE)
    runner_up: RunnerUp | None

    @classmethod
    def pack(cls, alignment: Alignment) -> Self:
        """Return `alignment` for the wire."""
        return cls(
            reference=alignment.reference,
            other=alignment.other,
            transform=_transform(alignment.transform),
            decision=alignment.decision,
            confidence=float(alignment.confidence),
            reason=alignment.reason,
            evidence={name: float(number) for name, number in alignment.evidence.items()},
            runner_up=_pack_runner_up(alignment.runner_up),
        )

    def unpack(self) -> Alignment:
        """Return the alignment."""
        return Alignment(
            reference=self.reference,
            other=self.other,
            transform=np.array(self.transform),
            decision=self.decision,
            confidence=self.confidence,
            reason=self.reason,
            evidence=dict(self.evidence),
            runner_up=_unpack_runner_up(self.runner_up),
        )


def _pack_runner_up(runner_up: Mapping[str, object] | None) -> RunnerUp | None:
    if runner_up is None:
        return None
    # Its transform has three numbers, everything else in it is one number.
    arrays = {name: np.asarray(value, dtype=float) for name, value in runner_up.items()}
    transform = _transform(arrays.pop("transform"))
    return RunnerUp(
        transform=transform, numbers={name: float(array) for name, array in arrays.items()}
    )


def _unpack_runner_up(runner_up: RunnerUp | None) -> dict[str, object] | None:
    if runner_up is None:
        return None
    return {"transform": list(runner_up.transform), **runner_up.numbers}


class AlignmentMessage(Message):
    """How the components of two robots lie to each other: refusals included.

    Attributes
    ----------
    robot
        Who found out.
    reference, other
        From which states of which maps.
    alignments
        One for each pair of components, its `reference` of the robot `reference`.
    """

    format: ClassVar[str] = "mapweave/alignment-message/1"

    robot: Id
    reference: MapVersion
    other: MapVersion
    alignments: tuple[WireAlignment, ...] = Field(max_length=MAX_ALIGNMENTS)

    @classmethod
    def pack(
        cls,
        robot: str,
        reference: MapVersion,
        other: MapVersion,
        alignments: Iterable[Alignment],
    ) -> Self:
        """Return the message of what `robot` found out about two maps."""
        packed = tuple(WireAlignment.pack(alignment) for alignment in alignments)
        return cls(robot=robot, reference=reference, other=other, alignments=packed)

    @model_validator(mode="after")
    def _check(self) -> Self:
        for alignment in self.alignments:
            robots = {alignment.reference.split("/")[0], alignment.other.split("/")[0]}
            if not robots <= {self.reference.robot, self.other.robot}:
                raise ValueError(f"{alignment.reference} and {alignment.other}: another pair")
        return self

    def unpack(self) -> tuple[Alignment, ...]:
        """Return the alignments."""
        return tuple(alignment.unpack() for alignment in self.alignments)


class Compared(WireModel):
    """From which states of the maps a pair's alignment was last published."""

    own_version: Count
    peer_boot: Id
    peer_version: Count


class Traffic(WireModel):
    """What was published of one kind."""

    messages: Count
    bytes: Count


class StatusMessage(Message):
    """How far a robot is.

    Attributes
    ----------
    stamp
        When it was said [s since 1970].
    scans_total
        How many scans there are to come in all, where known.
    compared
        By peer, for the pairs this robot compared.
    sent
        By kind of message: ``map``, ``alignment``, ``status``.
    """

    format: ClassVar[str] = "mapweave/status-message/1"

    robot: Id
    boot: Id
    stamp: Number
    state: Literal["mapping", "finished"]
    scans_seen: Count
    scans_placed: Count
    scans_total: Count | None = None
    components: Count
    submaps: Count
    map_version: Count
    compared: dict[Id, Compared] = Field(default_factory=dict, max_length=MAX_PEERS)
    sent: dict[Label, Traffic] = Field(default_factory=dict, max_length=16)


class WireComponent(WireModel):
    """A component of the joint map."""

    robots: dict[ComponentName, Transform] = Field(min_length=1, max_length=MAX_ALIGNMENTS)
    confidence: Probability
    lines: PackedLines
    segment_confidence: bytes = Field(max_length=MAX_BYTES)

    @classmethod
    def pack(cls, component: JointComponent) -> Self:
        """Return `component` for the wire; confidences of segments in per mille."""
        lines = PackedLines.pack(component.map, WORLD_REACH)
        # Segments too short for the wire vanish from both alike: count what is left.
        kept = PackedLines.kept(component.map, WORLD_REACH)
        confidence = packing.quantise(component.segment_confidence[kept], 1e3, 1.0)
        return cls(
            robots={name: _transform(pose) for name, pose in component.robots.items()},
            confidence=float(component.confidence),
            lines=lines,
            segment_confidence=packing.pack_integers(confidence[:, None]),
        )

    @model_validator(mode="after")
    def _check(self) -> Self:
        self.unpack()
        return self

    def unpack(self) -> JointComponent:
        """Return the component.

        Raises
        ------
        ValueError
            If its arrays do not fit each other.
        """
        lines = self.lines.unpack(WORLD_REACH)
        permille = packing.unpack_integers(self.segment_confidence, 1, MAX_SEGMENTS)[:, 0]
        if len(permille) != len(lines.segments) or np.any(permille < 0):
            raise ValueError("segment confidences, expected one of 0 to 1 for each segment")
        return JointComponent(
            robots={name: np.array(pose) for name, pose in self.robots.items()},
            confidence=self.confidence,
            map=lines,
            segment_confidence=packing.unquantise(permille, 1e3, 1.0),
        )


class JointMapMessage(Message):
    """A version of the joint map, complete.

    Attributes
    ----------
    series
        Names the store that counts these versions; another store counts from 1 again.
    version
        1, 2, 3…
    """

    format: ClassVar[str] = "mapweave/joint-message/1"

    series: Id
    version: int = Field(ge=1, le=2**53)
    components: tuple[WireComponent, ...] = Field(max_length=MAX_ALIGNMENTS)
    alignments: tuple[WireAlignment, ...] = Field(max_length=MAX_ALIGNMENTS)

    @classmethod
    def pack(cls, joint: JointMap, series: str) -> Self:
        """Return `joint` as the message of a version of `series`."""
        return cls(
            series=series,
            version=joint.version,
            components=tuple(WireComponent.pack(component) for component in joint.components),
            alignments=tuple(WireAlignment.pack(alignment) for alignment in joint.alignments),
        )

    def unpack(self) -> JointMap:
        """Return the joint map."""
        return JointMap(
            self.version,
            tuple(component.unpack() for component in self.components),
            tuple(alignment.unpack() for alignment in self.alignments),
        )
