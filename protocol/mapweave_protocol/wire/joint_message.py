"""A version of the joint map as a message."""

from functools import cached_property
from typing import ClassVar, Self

import numpy as np
from pydantic import Field, model_validator

from mapweave.maps import JointComponent, JointMap
from mapweave_protocol.wire.alignment_message import WireAlignment
from mapweave_protocol.wire.coding.entropy import Decoder, Encoder
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
    """A component of the joint map; `stream` is its lines with their confidence."""

    robots: dict[ComponentName, JointTransform] = Field(min_length=1, max_length=MAX_ALIGNMENTS)
    confidence: Probability
    stream: bytes = Field(max_length=MAX_BYTES)
    marks: tuple[WirePlacedMark, ...] = Field(default=(), max_length=MAX_ALIGNMENTS)

    @classmethod
    def pack(cls, component: JointComponent) -> Self:
        """Return `component` for the wire."""
        encoder = Encoder()
        lines = PackedLines.pack(component.map, JOINT_REACH, component.segment_confidence)
        PackedLines.code(encoder, lines, confident=True)
        return cls(
            robots={name: to_transform(pose) for name, pose in component.robots.items()},
            confidence=round(float(component.confidence), 4),
            stream=encoder.finish(),
            marks=tuple(WirePlacedMark.pack(mark) for mark in component.marks),
        )

    @model_validator(mode="after")
    def _check(self) -> Self:
        self.unpack()
        return self

    @cached_property
    def _lines(self) -> PackedLines:
        return PackedLines.code(Decoder(self.stream), None, confident=True)

    def unpack(self) -> JointComponent:
        """Return the component.

        Raises
        ------
        ValueError
            If its stream is damaged.
        """
        certainties = self._lines.lines.confidence
        if certainties is None:
            raise ValueError("segments without a confidence")
        return JointComponent(
            robots={name: np.array(pose) for name, pose in self.robots.items()},
            confidence=self.confidence,
            map=self._lines.unpack(JOINT_REACH),
            segment_confidence=certainties / CERTAINTIES,
            marks=tuple(mark.unpack() for mark in self.marks),
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

    letter: ClassVar[bytes] = b"j"
    format: ClassVar[str] = "joint map"

    series: Id
    version: int = Field(ge=1, le=2**53)
    components: tuple[WireComponent, ...] = Field(max_length=MAX_ALIGNMENTS)
    alignments: tuple[WireAlignment, ...] = Field(max_length=MAX_ALIGNMENTS)
    orders: tuple[WireOrder, ...] = Field(default=(), max_length=MAX_ORDERS)

    @classmethod
    def pack(cls, joint: JointMap, series: str) -> Self:
        """Return `joint` as the message of a version of `series`."""
        return cls(
            series=series,
            version=joint.version,
            components=tuple(WireComponent.pack(component) for component in joint.components),
            alignments=tuple(WireAlignment.pack(alignment) for alignment in joint.alignments),
            orders=tuple(WireOrder.pack(order) for order in joint.orders),
        )

    def unpack(self) -> JointMap:
        """Return the joint map."""
        return JointMap(
            self.version,
            tuple(component.unpack() for component in self.components),
            tuple(alignment.unpack() for alignment in self.alignments),
            orders=tuple(order.unpack() for order in self.orders),
        )
