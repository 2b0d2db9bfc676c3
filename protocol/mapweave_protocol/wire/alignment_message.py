"""How two robots' maps lie to each other, as a message."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields
from functools import cached_property
from typing import Annotated, ClassVar, Self

import numpy as np
from pydantic import Field, model_validator
from pydantic.functional_validators import ModelWrapValidatorHandler  # 2.7 has it here only

from mapweave.evidence import Evidence, RunnerUp
from mapweave.maps import Alignment, Decision, RobotMap, SharedPlace, parse_component
from mapweave.reasons import Reason, ReasonKind, Status, StatusKind
from mapweave.team.recent import Recent
from mapweave_protocol.wire.budget import MIB, Budget
from mapweave_protocol.wire.coding.extensions import Extended, extended
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
    WholeStep,
    WireModel,
    to_transform,
)

MAX_EVIDENCE = 64
EVIDENCE = tuple(field.name for field in fields(Evidence))
OF_REASONS = (
    "common", "contradicted", "distance", "turn", "rival_common", "rival_contradicted", "outside",
    "confidence", "min_wall", "parts", "spread", "reach", "tolerance",
)  # fmt: skip
MAX_PLACES = 16
STEPS = np.array([1e3, 1e3, 1e4])  # a metre, a metre, a radian, as they travel
CENTIMETRES = 100
REMEMBERED = 4096  # states of maps, some 0.4 kB each

_told: dict[tuple[object, ...], "MapVersion"] = {}


class MapVersion(WireModel):
    """Which state of which robot's map."""

    robot: Id
    boot: Id
    version: Count

    @model_validator(mode="wrap")
    @classmethod
    def _told_before(cls, fields: object, handler: ModelWrapValidatorHandler[Self]) -> Self:
        """Check what was not told before: statuses name hundreds, and mostly the same again."""
        # True and 1.0 are equal to 1, and no whole numbers.
        if not isinstance(fields, tuple) or tuple(map(type, fields)) != (str, str, int):
            return handler(fields)
        known = _told.get(fields)
        if isinstance(known, cls):
            return known
        if len(_told) >= REMEMBERED:
            _told.clear()
        _told[fields] = checked = handler(fields)
        return checked

    @classmethod
    def of(cls, robot_map: RobotMap) -> Self:
        """Return which state `robot_map` is."""
        return cls(robot=robot_map.robot, boot=robot_map.boot, version=robot_map.version)


class WireRunnerUp(WireModel):
    """The best different hypothesis."""

    placed: ClassVar[Mapping[str, Sequence[str]]] = {"numbers": ("distance", "turn", *EVIDENCE)}

    transform: Transform
    numbers: dict[Label, Number] = Field(max_length=MAX_EVIDENCE)

    @classmethod
    def pack(cls, runner_up: RunnerUp) -> Self:
        """Return `runner_up` for the wire; what could not be measured is left out."""
        transform = to_transform(runner_up.transform)
        return cls(transform=transform, numbers=_measured(runner_up.by_name()))

    def unpack(self) -> RunnerUp:
        """Return the hypothesis."""
        return RunnerUp.of(np.array(self.transform), self.numbers)


class WireReason(WireModel):
    """Why an alignment was decided as it was."""

    placed: ClassVar[Mapping[str, Sequence[str]]] = {"numbers": OF_REASONS}

    kind: Annotated[ReasonKind, Field(strict=False)]  # on the wire it is its name
    numbers: dict[Label, float] = Field(max_length=MAX_EVIDENCE)
    text: Sentence = ""
    found: "WireReason | None" = None

    @classmethod
    def pack(cls, reason: Reason) -> Self:
        """Return `reason` for the wire."""
        return cls(
            kind=reason.kind,
            numbers={name: _short(number) for name, number in reason.numbers.items()},
            text=reason.text,
            found=None if reason.found is None else cls.pack(reason.found),
        )

    @model_validator(mode="after")
    def _check(self) -> Self:
        self.unpack()
        return self

    def unpack(self) -> Reason:
        """Return the reason.

        Raises
        ------
        ValueError
            If its numbers are not those of its kind.
        """
        found = None if self.found is None else self.found.unpack()
        return Reason(self.kind, dict(self.numbers), found, self.text)


class WirePlace(WireModel):
    """A place where an alignment holds: two submaps by their ids, and how they lie, in integers.

    Attributes
    ----------
    step
        Of the other in the frame of the reference's [mm, mm, 0.1 mrad].
    at
        In the frame of the alignment's reference [cm].
    """

    reference: Count
    other: Count
    step: tuple[WholeStep, WholeStep, WholeStep]
    at: tuple[WholeStep, WholeStep]

    @classmethod
    def pack(cls, place: SharedPlace) -> Self:
        """Return `place` for the wire."""
        x, y, turn = np.round(place.transform * STEPS).astype(int).tolist()
        east, north = np.round(place.at * CENTIMETRES).astype(int).tolist()
        return cls(
            reference=place.reference, other=place.other, step=(x, y, turn), at=(east, north)
        )

    def unpack(self) -> SharedPlace:
        """Return the place."""
        step, at = np.array(self.step) / STEPS, np.array(self.at) / CENTIMETRES
        return SharedPlace(self.reference, self.other, step, at)


class WireAlignment(WireModel):
    """An alignment of two components."""

    placed: ClassVar[Mapping[str, Sequence[str]]] = {"evidence": EVIDENCE}

    reference: ComponentName
    other: ComponentName
    transform: Transform
    decision: Decision
    confidence: Probability
    evidence: dict[Label, Number] = Field(max_length=MAX_EVIDENCE)
    runner_up: WireRunnerUp | None
    cause: WireReason
    status: Annotated[StatusKind | None, Field(strict=False)] = None
    set_aside_by: tuple[tuple[ComponentName, ComponentName], ...] = Field(
        default=(), max_length=MAX_ALIGNMENTS
    )
    revoked_in: Count | None = None
    places: tuple[WirePlace, ...] = Field(default=(), max_length=MAX_PLACES)

    @classmethod
    def pack(cls, alignment: Alignment) -> Self:
        """Return `alignment` for the wire; what could not be measured is left out."""
        rival, status = alignment.runner_up, alignment.status
        return cls(
            reference=alignment.reference,
            other=alignment.other,
            transform=to_transform(alignment.transform),
            decision=alignment.decision,
            confidence=_short(alignment.confidence),
            evidence=_measured(alignment.evidence.by_name()),
            runner_up=None if rival is None else WireRunnerUp.pack(rival),
            status=None if status is None else status.kind,
            set_aside_by=() if status is None else status.set_aside_by,
            revoked_in=None if status is None else status.revoked_in,
            cause=WireReason.pack(alignment.cause),
            places=tuple(WirePlace.pack(place) for place in alignment.places[:MAX_PLACES]),
        )

    @model_validator(mode="after")
    def _check(self) -> Self:
        self._status()
        return self

    @cached_property
    def travelling(self) -> Extended:
        """What `values` returns: of version after version, most alignments are as they were."""
        return Extended([extended(value) for value in super().values()])

    def values(self) -> tuple[object, ...]:
        """Return the values of the fields, in their order, as they travel."""
        return self.travelling

    def model_copy(self, *, update: Mapping[str, object] | None = None, deep: bool = False) -> Self:
        """Return a copy, with other values of some fields; of its own how these travel."""
        copied = super().model_copy(update=update, deep=deep)
        copied.__dict__.pop("travelling", None)
        return copied

    def unpack(self) -> Alignment:
        """Return the alignment."""
        return Alignment(
            reference=self.reference,
            other=self.other,
            transform=np.array(self.transform),
            decision=self.decision,
            confidence=self.confidence,
            cause=self.cause.unpack(),
            evidence=Evidence.of(self.evidence),
            runner_up=None if self.runner_up is None else self.runner_up.unpack(),
            status=self._status(),
            places=tuple(place.unpack() for place in self.places),
        )

    def _status(self) -> Status | None:
        if self.status is None:
            return None
        return Status(self.status, self.set_aside_by, self.revoked_in)


class AlignmentPacker:
    """Packs the alignments of one version after the other, those that changed anew."""

    def __init__(self) -> None:
        self._kept: Recent[tuple[object, ...], tuple[Alignment, WireAlignment]] = Recent()

    def pack(self, alignments: Sequence[Alignment]) -> tuple[WireAlignment, ...]:
        """Return `alignments` for the wire."""
        self._kept.turn()
        return tuple(self._packed(alignment)[1] for alignment in alignments)

    def _packed(self, alignment: Alignment) -> tuple[Alignment, WireAlignment]:
        """Return what is kept of `alignment`: itself, so that nothing else has its parts' ids."""
        a = alignment
        parts = a.transform, a.cause, a.evidence, a.runner_up, a.places
        key = a.reference, a.other, a.decision, a.confidence, a.status, *map(id, parts)
        return self._kept.get(key, lambda: (a, WireAlignment.pack(a)))


def _measured(numbers: Mapping[str, float]) -> dict[str, float]:
    """Return the finite ones of `numbers`; the residual of nothing, say, is none."""
    return {name: _short(number) for name, number in numbers.items() if math.isfinite(number)}


class AlignmentMessage(Message):
    """How the components of two robots lie to each other: refusals included.

    Attributes
    ----------
    robot
        Who found out.
    reference, other
        From which states of which maps.
    alignments
        One for each pair of components, its `reference` of the robot `reference`. Of two runs of
        a robot, its `reference` is of the run `reference`.
    """

    letter: ClassVar[bytes] = b"a"
    format: ClassVar[str] = "alignment"
    budget: ClassVar[Budget] = Budget(4 * MIB, 8 * MIB, 300_000)

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
            self.ends_of(alignment)
        return self

    def ends_of(self, alignment: Alignment | WireAlignment) -> tuple[MapVersion, MapVersion]:
        """Return which of the two maps each component of one of the alignments is of.

        Raises
        ------
        ValueError
            If it is of another pair.
        """
        names = alignment.reference, alignment.other
        for ours, theirs in ((self.reference, self.other), (self.other, self.reference)):
            if all(map(_is_of, names, (ours, theirs))):
                return ours, theirs
        raise ValueError(f"{alignment.reference} and {alignment.other}: another pair")

    def unpack(self) -> tuple[Alignment, ...]:
        """Return the alignments."""
        return tuple(alignment.unpack() for alignment in self.alignments)


def _is_of(component: str, run: MapVersion) -> bool:
    """Tell whether a component, by its name, may be one of a run."""
    robot, _, boot = parse_component(component)[0].partition("@")
    return robot == run.robot and boot in ("", run.boot)


def _short(number: float) -> float:
    """Return `number` with no more digits than were measured: each costs bytes."""
    return float(f"{number:.4g}")
