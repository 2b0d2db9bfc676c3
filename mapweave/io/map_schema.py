"""What stands in ``MAP.json`` and ``JOINT.json``, as models that check it and turn it into maps.

Fields that are not known here are ignored, so that a later version may add some. A number that
is not known (a stamp, say) is NaN in memory and ``null`` in the file.
"""

import math
from collections.abc import Sequence
from typing import Annotated, Literal, TypeAlias

import numpy as np
from pydantic import AfterValidator, ConfigDict, Field, model_validator

from mapweave.evidence import Evidence, RunnerUp
from mapweave.geometry.arrays import BoolArray, FloatArray
from mapweave.io.annotations import MarkFile, OrderFile, PlacedMarkFile
from mapweave.io.file_types import ComponentName, Count, FileModel, Metre, Pose, RobotId
from mapweave.maps import (
    Alignment,
    Decision,
    JointComponent,
    JointMap,
    LineMap,
    MadeWith,
    RobotMap,
    SharedPlace,
    Submap,
    Trajectory,
)
from mapweave.reasons import Reason, ReasonKind, Status, StatusKind

_MapFormat: TypeAlias = Literal["mapweave/map/1"]
_JointFormat: TypeAlias = Literal["mapweave/joint/1"]
MAP_FORMAT: _MapFormat = "mapweave/map/1"
JOINT_FORMAT: _JointFormat = "mapweave/joint/1"

MAX_SEGMENT = 1000.0  # [m]; no lidar sees farther
_Probability: TypeAlias = Annotated[float, Field(ge=0, le=1)]


def _seen_at_once(segment: tuple[float, float, float, float]) -> tuple[float, ...]:
    x1, y1, x2, y2 = segment
    if math.hypot(x2 - x1, y2 - y1) > MAX_SEGMENT:
        raise ValueError(f"expected a segment of at most {MAX_SEGMENT:g} m")
    return segment


_Segment: TypeAlias = Annotated[tuple[Metre, Metre, Metre, Metre], AfterValidator(_seen_at_once)]
_Polyline: TypeAlias = Annotated[list[_Segment], Field(min_length=1)]
_Polygon: TypeAlias = Annotated[list[tuple[Metre, Metre]], Field(min_length=3)]
_TrajectoryRow: TypeAlias = tuple[Count, float | None, Metre, Metre, float]
_Deviation: TypeAlias = Annotated[float, Field(ge=0, le=1e6)]
_UncertaintyRow: TypeAlias = tuple[_Deviation, _Deviation, _Deviation, float]


class _LinesFile(FileModel):
    """What submaps and joint components have in common."""

    polylines: list[_Polyline]
    support: list[list[Count]]

    @model_validator(mode="after")
    def _support_fits(self) -> "_LinesFile":
        _check_nesting("support", self.support, self.polylines)
        return self

    def line_map(self, free_space: Sequence[Sequence[tuple[float, float]]]) -> LineMap:
        kept = self.have_length()
        counts = [len(polyline) for polyline in self.polylines]
        polyline = np.repeat(np.arange(len(counts), dtype=np.int64), counts)[kept]
        return LineMap(
            segments=self._segments()[kept],
            polyline=np.unique(polyline, return_inverse=True)[1],
            support=np.array(_flat(self.support), dtype=np.int64)[kept],
            free_space=tuple(np.array(polygon, dtype=np.float64) for polygon in free_space),
        )

    def have_length(self) -> BoolArray:
        """Tell of each segment whether it has a length; a point is no wall."""
        segments = self._segments()
        kept: BoolArray = np.any(segments[:, :2] != segments[:, 2:], axis=1)
        return kept

    def _segments(self) -> FloatArray:
        return np.array(_flat(self.polylines), dtype=np.float64).reshape(-1, 4)


class HeaderFile(FileModel):
    """What both kinds of file start with: enough to tell which of them it is."""

    format: Literal["mapweave/map/1", "mapweave/joint/1"]


class SubmapFile(_LinesFile):
    """One of the ``submaps`` of a map file."""

    id: Count
    component: Count
    pose: Pose
    free_space: list[_Polygon]
    trajectory: list[_TrajectoryRow]
    uncertainty: list[_UncertaintyRow] | None = None

    @model_validator(mode="after")
    def _uncertainty_fits(self) -> "SubmapFile":
        if self.uncertainty is not None and len(self.uncertainty) != len(self.trajectory):
            raise ValueError(
                f"uncertainty has {len(self.uncertainty)} rows,"
                f" expected {len(self.trajectory)} as in trajectory"
            )
        return self

    def to_submap(self) -> Submap:
        """Return it as the library's value."""
        lines = self.line_map(self.free_space)
        return Submap(self.id, self.component, np.array(self.pose), lines, self._trajectory())

    def _trajectory(self) -> Trajectory:
        rows = self.trajectory
        return Trajectory(
            scan_index=np.array([row[0] for row in rows], dtype=np.int64),
            stamp=np.array([_unknown_as_nan(row[1]) for row in rows], dtype=np.float64),
            pose=np.array([row[2:] for row in rows], dtype=np.float64).reshape(-1, 3),
            uncertainty=self._uncertainty(),
        )

    def _uncertainty(self) -> FloatArray | None:
        if self.uncertainty is None:
            return None
        return np.array(self.uncertainty, dtype=np.float64).reshape(-1, 4)


class MadeWithFile(FileModel):
    """What a map was made with; the settings are those of the version that made it."""

    program: str
    config: dict[str, dict[str, int | float | str | bool | list[list[float]] | None]]

    def to_made_with(self) -> MadeWith:
        """Return it as the library's value."""
        return MadeWith(self.program, self.config)


class MapFile(FileModel):
    """A whole ``MAP.json``."""

    format: _MapFormat
    robot: RobotId
    boot: str
    version: Count
    made_with: MadeWithFile | None = None
    submaps: list[SubmapFile]
    marks: list[MarkFile] = Field(default_factory=list)

    @model_validator(mode="after")
    def _ids_ascend(self) -> "MapFile":
        ids = [submap.id for submap in self.submaps]
        if ids != sorted(set(ids)):
            raise ValueError("the ids of submaps should ascend, each used once")
        return self

    def to_map(self) -> RobotMap:
        """Return it as the library's value."""
        submaps = tuple(submap.to_submap() for submap in self.submaps)
        marks = tuple(mark.to_mark() for mark in self.marks)
        return RobotMap(self.robot, self.boot, self.version, submaps, _known(self.made_with), marks)


class EvidenceFile(FileModel):
    """The ``evidence`` of an alignment; what could not be measured is left out or ``null``."""

    common: float | None = None
    contradicted: float | None = None
    overlap: float | None = None
    residual: float | None = None
    held: float | None = None
    complexity: float | None = None
    rarity: float | None = None
    score: float | None = None
    parts: float | None = None
    spread: float | None = None
    reach: float | None = None
    place: float | None = None

    def numbers(self) -> dict[str, float]:
        """Return what the file gives, by name."""
        given = self.model_dump(include=self.model_fields_set - {"transform"})
        return {name: _unknown_as_nan(number) for name, number in given.items()}


class RunnerUpFile(EvidenceFile):
    """The ``runner_up`` of an alignment."""

    transform: Pose
    distance: float | None = None
    turn: float | None = None

    def to_runner_up(self) -> RunnerUp:
        """Return it as the library's value."""
        return RunnerUp.of(np.array(self.transform), self.numbers())


class CauseFile(FileModel):
    """The ``cause`` of an alignment: a kind, and beside it the numbers of that kind."""

    model_config = ConfigDict(extra="allow")

    kind: str
    text: str = ""
    found: "CauseFile | None" = None

    @model_validator(mode="after")
    def _numbers_fit(self) -> "CauseFile":
        self.to_reason()
        return self

    def to_reason(self) -> Reason | None:
        """Return it as the library's value; None if it, or what it is about, is not known here."""
        found = None if self.found is None else self.found.to_reason()
        if self.kind not in set(ReasonKind) or (found is None and self.found is not None):
            return None
        extra = self.model_extra or {}
        numbers = {n: v for n, v in extra.items() if v is None or isinstance(v, int | float)}
        known = {name: _unknown_as_nan(number) for name, number in numbers.items()}
        return Reason.picked(ReasonKind(self.kind), known, found, self.text)


class AlignmentFile(FileModel):
    """One of the ``alignments`` of a joint map file."""

    reference: ComponentName
    other: ComponentName
    transform: Pose
    confidence: _Probability
    decision: Decision
    reason: str
    evidence: EvidenceFile
    runner_up: RunnerUpFile | None
    status: StatusKind | None = None
    set_aside_by: list[tuple[ComponentName, ComponentName]] = Field(default_factory=list)
    revoked_in: Count | None = None
    cause: CauseFile | None = None
    anchors: list[tuple[Count, Count, Metre, Metre, float]] = Field(default_factory=list)
    at: list[tuple[Metre, Metre]] = Field(default_factory=list)

    @model_validator(mode="after")
    def _anchors_fit(self) -> "AlignmentFile":
        if len(self.at) != len(self.anchors):
            raise ValueError(
                f"at: expected as many places as anchors, {len(self.anchors)}, got {len(self.at)}"
            )
        return self

    @model_validator(mode="after")
    def _status_fits(self) -> "AlignmentFile":
        self._status()
        return self

    def to_alignment(self) -> Alignment:
        """Return it as the library's value.

        Where the cause is not given, or of a kind that is not known here, the sentence is all that
        is known: it says as well what became of the alignment.
        """
        cause = None if self.cause is None else self.cause.to_reason()
        return Alignment(
            reference=self.reference,
            other=self.other,
            transform=np.array(self.transform),
            decision=self.decision,
            confidence=self.confidence,
            cause=Reason.words(self.reason) if cause is None else cause,
            evidence=Evidence.of(self.evidence.numbers()),
            runner_up=None if self.runner_up is None else self.runner_up.to_runner_up(),
            status=None if cause is None else self._status(),
            places=tuple(
                SharedPlace(reference, other, np.array(pose), np.array(at))
                for (reference, other, *pose), at in zip(self.anchors, self.at, strict=True)
            ),
        )

    def _status(self) -> Status | None:
        if self.status is None:
            return None
        return Status(self.status, tuple(self.set_aside_by), self.revoked_in)


class ComponentFile(_LinesFile):
    """One of the ``components`` of a joint map file."""

    robots: Annotated[dict[ComponentName, Pose], Field(min_length=1)]
    confidence: _Probability
    segment_confidence: list[list[_Probability]]
    free_space: list[_Polygon] = Field(default_factory=list)
    explored_m2: float | None = None  # both follow from the map, and are not read
    frontiers: list[list[tuple[float, float]]] = Field(default_factory=list)
    marks: list[PlacedMarkFile] = Field(default_factory=list)

    @model_validator(mode="after")
    def _confidence_fits(self) -> "ComponentFile":
        _check_nesting("segment_confidence", self.segment_confidence, self.polylines)
        return self

    def to_component(self) -> JointComponent:
        """Return it as the library's value."""
        sure = np.array(_flat(self.segment_confidence), dtype=np.float64)
        return JointComponent(
            robots={name: np.array(pose) for name, pose in self.robots.items()},
            confidence=self.confidence,
            map=self.line_map(self.free_space),
            segment_confidence=sure[self.have_length()],
            marks=tuple(mark.to_mark() for mark in self.marks),
        )


class JointFile(FileModel):
    """A whole ``JOINT.json``."""

    format: _JointFormat
    version: Count
    made_with: MadeWithFile | None = None
    alignments: list[AlignmentFile]
    components: list[ComponentFile]
    orders: list[OrderFile] = Field(default_factory=list)

    def to_map(self) -> JointMap:
        """Return it as the library's value."""
        return JointMap(
            version=self.version,
            components=tuple(component.to_component() for component in self.components),
            alignments=tuple(alignment.to_alignment() for alignment in self.alignments),
            made_with=_known(self.made_with),
            orders=tuple(order.to_order() for order in self.orders),
        )


def _known(made_with: MadeWithFile | None) -> MadeWith | None:
    return None if made_with is None else made_with.to_made_with()


def _check_nesting(
    name: str, values: Sequence[Sequence[float]], polylines: Sequence[Sequence[_Segment]]
) -> None:
    """Raise `ValueError` unless `values` holds one number for each segment, nested alike."""
    found, expected = [len(row) for row in values], [len(polyline) for polyline in polylines]
    if len(found) != len(expected):
        raise ValueError(f"{name} has {len(found)} lists, expected {len(expected)} as in polylines")
    for row, (count, wanted) in enumerate(zip(found, expected, strict=True)):
        if count != wanted:
            raise ValueError(
                f"{name}[{row}] has {count} numbers, expected {wanted} as in polylines[{row}]"
            )


def _flat(rows: Sequence[Sequence[object]]) -> list[object]:
    return [value for row in rows for value in row]


def _unknown_as_nan(value: float | None) -> float:
    return np.nan if value is None else value
