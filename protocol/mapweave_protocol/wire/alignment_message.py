"""How two robots' maps lie to each other, as a message."""

import math
from collections.abc import Iterable, Mapping
from typing import ClassVar, Self

import numpy as np
from pydantic import Field, model_validator

from mapweave.maps import Alignment, Decision, RobotMap
from mapweave_protocol.wire.model import (
    MAX_ALIGNMENTS,
    ComponentName,
    Count,
    Id,
    Label,
    Message,
    Number,
    Probability,
    Sentence,
    Transform,
    WireModel,
    to_transform,
)

MAX_EVIDENCE = 64


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
    reason: Sentence
    evidence: dict[Label, Number] = Field(max_length=MAX_EVIDENCE)
    runner_up: RunnerUp | None

    @classmethod
    def pack(cls, alignment: Alignment) -> Self:
        """Return `alignment` for the wire; what could not be measured is left out."""
        return cls(
            reference=alignment.reference,
            other=alignment.other,
            transform=to_transform(alignment.transform),
            decision=alignment.decision,
            confidence=float(alignment.confidence),
            reason=alignment.reason,
            evidence=_measured(alignment.evidence),
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


def _measured(numbers: Mapping[str, float]) -> dict[str, float]:
    """Return the finite ones of `numbers`; the residual of nothing, say, is none."""
    return {name: float(number) for name, number in numbers.items() if math.isfinite(number)}


def _pack_runner_up(runner_up: Mapping[str, object] | None) -> RunnerUp | None:
    if runner_up is None:
        return None
    # Its transform has three numbers, everything else in it is one number.
    arrays = {name: np.asarray(value, dtype=float) for name, value in runner_up.items()}
    transform = to_transform(arrays.pop("transform"))
    numbers = _measured({name: float(array) for name, array in arrays.items()})
    return RunnerUp(transform=transform, numbers=numbers)


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
