"""A version of the joint map as a message."""

from typing import ClassVar, Self

import numpy as np
from pydantic import Field, model_validator

from mapweave.maps import JointComponent, JointMap
from mapweave_protocol.wire import packing
from mapweave_protocol.wire.alignment_message import WireAlignment
from mapweave_protocol.wire.geometry import MAX_BYTES, MAX_SEGMENTS, PackedLines
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
    """A component of the joint map."""

    robots: dict[ComponentName, JointTransform] = Field(min_length=1, max_length=MAX_ALIGNMENTS)
    confidence: Probability
    lines: PackedLines
    segment_confidence: bytes = Field(max_length=MAX_BYTES)
    marks: tuple[WirePlacedMark, ...] = Field(default=(), max_length=MAX_ALIGNMENTS)

    @classmethod
    def pack(cls, component: JointComponent) -> Self:
        """Return `component` for the wire; confidences of segments in per mille."""
        lines = PackedLines.pack(component.map, JOINT_REACH)
        # Segments too short for the wire vanish from both alike: count what is left.
        kept = PackedLines.kept(component.map, JOINT_REACH)
        confidence = packing.quantise(component.segment_confidence[kept], 1e3, 1.0)
        return cls(
            robots={name: to_transform(pose) for name, pose in component.robots.items()},
            confidence=float(component.confidence),
            lines=lines,
            segment_confidence=packing.pack_integers(confidence[:, None]),
            marks=tuple(WirePlacedMark.pack(mark) for mark in component.marks),
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
        lines = self.lines.unpack(JOINT_REACH)
        permille = packing.unpack_integers(self.segment_confidence, 1, MAX_SEGMENTS)[:, 0]
        if len(permille) != len(lines.segments) or np.any(permille < 0):
            raise ValueError("segment confidences, expected one of 0 to 1 for each segment")
        return JointComponent(
            robots={name: np.array(pose) for name, pose in self.robots.items()},
            confidence=self.confidence,
            map=lines,
            segment_confidence=packing.unquantise(permille, 1e3, 1.0),
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

    format: ClassVar[str] = "mapweave/joint-message/1"

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
