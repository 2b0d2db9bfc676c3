"""A version of the joint map as a message."""

from collections.abc import Sequence
from functools import cached_property
from typing import ClassVar, Self

import numpy as np
from pydantic import Field, ValidationInfo, model_validator

from mapweave.geometry.arrays import FloatArray
from mapweave.maps import JointComponent, JointMap, LineMap
from mapweave.team.recent import Recent
from mapweave_protocol.errors import MessageError
from mapweave_protocol.wire.alignment_message import AlignmentPacker, WireAlignment
from mapweave_protocol.wire.budget import MIB, Budget
from mapweave_protocol.wire.coding import entropy
from mapweave_protocol.wire.coding.line_code import CERTAINTIES
from mapweave_protocol.wire.geometry import MAX_BYTES, PackedLines
from mapweave_protocol.wire.model import (
    JOINT_REACH,
    MAX_ALIGNMENTS,
    ComponentName,
    Id,
    JointTransform,
    Message,
    Probability,
    WireModel,
    to_transform,
)
from mapweave_protocol.wire.orders.marks_message import WirePlacedMark
from mapweave_protocol.wire.orders.order_message import MAX_ORDERS, WireOrder


class WireComponent(WireModel):
    """A component of the joint map.

    Attributes
    ----------
    robots
        Where each component of a robot lies in it.
    confidence
        Of what joins them.
    stream
        Its lines with their confidence, or what changed of them.
    before
        A robot's component that names one of the version before, whose lines changed; None where
        `stream` is all there is.
    """

    robots: dict[ComponentName, JointTransform] = Field(min_length=1, max_length=MAX_ALIGNMENTS)
    confidence: Probability
    stream: bytes = Field(max_length=MAX_BYTES)
    marks: tuple[WirePlacedMark, ...] = Field(default=(), max_length=MAX_ALIGNMENTS)
    before: ComponentName | None = None

    @classmethod
    def pack(cls, component: JointComponent, packer: "JointPacker | None" = None) -> Self:
        """Return `component` for the wire; its lines are packed by `packer`, if that is given."""
        lines, stream = (packer or JointPacker()).lines(component)
        fields = {
            "robots": {name: to_transform(pose) for name, pose in component.robots.items()},
            "confidence": round(float(component.confidence), 4),
            "stream": stream,
            "marks": tuple(WirePlacedMark.pack(mark) for mark in component.marks),
        }
        # What was packed here is in order, and need not be decoded to see it.
        return cls.model_validate(fields, context=lines)

    @classmethod
    def of_lines(
        cls,
        robots: dict[str, JointTransform],
        confidence: float,
        lines: PackedLines,
        marks: tuple[WirePlacedMark, ...],
    ) -> Self:
        """Return the component of these lines, whole."""
        return cls(robots=robots, confidence=confidence, stream=_encoded(lines), marks=marks)

    @model_validator(mode="after")
    def _check(self, info: ValidationInfo) -> Self:
        if isinstance(info.context, PackedLines):
            self.__dict__["lines"] = info.context
        elif self.before is None and "lines" not in self.__dict__:  # seen again with its message
            self.unpack()
        return self

    @cached_property
    def lines(self) -> PackedLines:
        """What `stream` says, if that is all there is."""
        if self.before is not None:
            raise ValueError("what changed of a component, expected all of it")
        return PackedLines.code(entropy.decoder(self.stream), None, confident=True)

    def since(self, name: str, before: Self) -> Self:
        """Return what makes the component `before`, which holds `name`, this one."""
        encoder = entropy.encoder()
        PackedLines.code_changes(encoder, before.lines, self.lines)
        return self.model_copy(update={"stream": encoder.finish(), "before": name})

    def over(self, before: Self) -> Self:
        """Return this component whole, if it is what changed of `before`.

        Raises
        ------
        ValueError
            If its stream is damaged.
        """
        lines = PackedLines.code_changes(entropy.decoder(self.stream), before.lines, None)
        return self.of_lines(self.robots, self.confidence, lines, self.marks)

    def unpack(self) -> JointComponent:
        """Return the component.

        Raises
        ------
        ValueError
            If its stream is damaged.
        """
        certainties = self.lines.lines.confidence
        if certainties is None:
            raise ValueError("segments without a confidence")
        return JointComponent(
            robots={name: np.array(pose) for name, pose in self.robots.items()},
            confidence=self.confidence,
            map=self.lines.unpack(JOINT_REACH),
            segment_confidence=certainties / CERTAINTIES,
            marks=tuple(mark.unpack() for mark in self.marks),
        )


class JointMapMessage(Message):
    """A version of the joint map, complete or what changed since the one before.

    Attributes
    ----------
    series
        Names the store that counts these versions; another store counts from 1 again.
    version
        1, 2, 3…
    alignments
        All of them, or those that changed.
    changes
        Whether it is what changed since the version before.
    gone
        Of which components alignments are no longer there.
    """

    letter: ClassVar[bytes] = b"j"
    format: ClassVar[str] = "joint map"
    budget: ClassVar[Budget] = Budget(16 * MIB, 32 * MIB, 300_000)

    series: Id
    version: int = Field(ge=1, le=2**53)
    components: tuple[WireComponent, ...] = Field(max_length=MAX_ALIGNMENTS)
    alignments: tuple[WireAlignment, ...] = Field(max_length=MAX_ALIGNMENTS)
    orders: tuple[WireOrder, ...] = Field(default=(), max_length=MAX_ORDERS)
    changes: bool = False
    gone: tuple[tuple[ComponentName, ComponentName], ...] = Field(
        default=(), max_length=MAX_ALIGNMENTS
    )

    @classmethod
    def pack(cls, joint: JointMap, series: str, packer: "JointPacker | None" = None) -> Self:
        """Return `joint` as the message of a version of `series`.

        Parameters
        ----------
        packer
            Packed the version before; None packs all.
        """
        packer = packer or JointPacker()
        packer.turn()
        return cls(
            series=series,
            version=joint.version,
            components=tuple(WireComponent.pack(each, packer) for each in joint.components),
            alignments=packer.alignments.pack(joint.alignments),
            orders=tuple(WireOrder.pack(order) for order in joint.orders),
        )

    @model_validator(mode="after")
    def _check(self) -> Self:
        if not self.changes and (self.gone or any(c.before for c in self.components)):
            raise ValueError("said to be complete, but only what changed is there")
        return self

    def since(self, before: Self) -> Self:
        """Return what changed since the version `before`, both complete.

        Raises
        ------
        ValueError
            If it is not the version before.
        """
        self._check_follows(before)
        told, now = _by_names(before.alignments), _by_names(self.alignments)
        return type(self)(
            series=self.series,
            version=self.version,
            components=tuple(_since(component, before.components) for component in self.components),
            alignments=tuple(a for names, a in now.items() if told.get(names) != a),
            orders=self.orders,
            changes=True,
            gone=tuple(names for names in told if names not in now),
        )

    def over(self, before: Self) -> Self:
        """Return this version, of which this is what changed since `before`, complete.

        Raises
        ------
        MessageError
            If it is not the version before, or does not go with it.
        """
        try:
            self._check_follows(before)
            alignments = _by_names(before.alignments) | _by_names(self.alignments)
            return type(self)(
                series=self.series,
                version=self.version,
                components=tuple(_over(c, before.components) for c in self.components),
                alignments=tuple(a for names, a in alignments.items() if names not in self.gone),
                orders=self.orders,
            )
        except ValueError as error:
            raise MessageError(self.format, f"version {self.version}: {error}") from error

    def unpack(self) -> JointMap:
        """Return the joint map; of a complete message.

        Raises
        ------
        MessageError
            If it is what changed.
        """
        if self.changes:
            raise MessageError(self.format, "what changed, expected a complete version")
        return JointMap(
            self.version,
            tuple(component.unpack() for component in self.components),
            tuple(alignment.unpack() for alignment in self.alignments),
            orders=tuple(order.unpack() for order in self.orders),
        )

    def follows(self, before: Self) -> bool:
        """Tell whether `before` is the version before this one, complete."""
        version = before.series, before.version + 1, before.changes
        return version == (self.series, self.version, False)

    def _check_follows(self, before: Self) -> None:
        if not self.follows(before):
            raise ValueError(f"expected version {self.version - 1} of {self.series} before it")


class JointPacker:
    """Packs one version after the other, what changed anew.

    Attributes
    ----------
    alignments
        Packs those.
    """

    def __init__(self) -> None:
        self.alignments = AlignmentPacker()
        self._lines: Recent[tuple[LineMap, int], tuple[PackedLines, bytes, FloatArray]] = Recent()

    def turn(self) -> None:
        """Begin another version."""
        self._lines.turn()

    def lines(self, component: JointComponent) -> tuple[PackedLines, bytes]:
        """Return the lines of `component` with their confidence, packed, and the stream of them.

        Raises
        ------
        ValueError
            If a coordinate is not finite, or too far out.
        """
        sure = component.segment_confidence

        def pack() -> tuple[PackedLines, bytes, FloatArray]:
            lines = PackedLines.pack(component.map, JOINT_REACH, sure)
            lines.check(JOINT_REACH)
            return lines, _encoded(lines), sure  # kept, so that nothing else has its id

        return self._lines.get((component.map, id(sure)), pack)[:2]


def _encoded(lines: PackedLines) -> bytes:
    encoder = entropy.encoder()
    PackedLines.code(encoder, lines, confident=True)
    return encoder.finish()


def _since(component: WireComponent, others: Sequence[WireComponent]) -> WireComponent:
    """Return what changed of `component`, or all of it where that is no more."""
    for name in component.robots:
        before = _with(name, others)
        if before is not None and before.lines.lines.turn == component.lines.lines.turn:
            changed = component.since(name, before)
            return changed if len(changed.stream) < len(component.stream) else component
    return component


def _over(component: WireComponent, others: Sequence[WireComponent]) -> WireComponent:
    if component.before is None:
        return component
    before = _with(component.before, others)
    if before is None:
        raise ValueError(f"{component.before} was in no component before")
    return component.over(before)


def _with(name: str, components: Sequence[WireComponent]) -> WireComponent | None:
    return next((one for one in components if name in one.robots), None)


def _by_names(alignments: Sequence[WireAlignment]) -> dict[tuple[str, str], WireAlignment]:
    return {(alignment.reference, alignment.other): alignment for alignment in alignments}
