"""The marks that a robot itself made, as a message; and marks where they lie in a joint map."""

from collections.abc import Iterable
from typing import ClassVar, Self

import numpy as np
from pydantic import Field, model_validator

from mapweave.marks import Anchor, Mark, PlacedMark
from mapweave_protocol.wire.model import (
    ComponentName,
    Count,
    Id,
    JointMetres,
    Label,
    Message,
    Metres,
    Number,
    WireModel,
)

MAX_MARKS = 1024  # of a run


class WireMark(WireModel):
    """A mark on a robot's map; fields as of `mapweave.marks.Mark`."""

    id: Id
    label: Label
    by: Id
    time: Number
    submap: Count
    scan: Count | None
    x: Metres
    y: Metres

    @classmethod
    def pack(cls, mark: Mark) -> Self:
        """Return `mark` for the wire."""
        x, y = (round(float(number), 4) for number in mark.position)
        held_by = mark.anchor
        return cls(
            id=mark.id, label=mark.label, by=mark.by, time=round(float(mark.time), 3),
            submap=held_by.submap, scan=held_by.scan, x=x, y=y,
        )  # fmt: skip

    def unpack(self) -> Mark:
        """Return the mark."""
        anchor = Anchor(self.submap, self.scan)
        return Mark(self.id, self.label, self.by, self.time, anchor, np.array([self.x, self.y]))


class MarksMessage(Message):
    """All marks that a run of a robot made, which replace those of an earlier version.

    Attributes
    ----------
    version
        How often they changed.
    """

    letter: ClassVar[bytes] = b"k"
    format: ClassVar[str] = "marks"

    robot: Id
    boot: Id
    version: Count
    marks: tuple[WireMark, ...] = Field(max_length=MAX_MARKS)

    @classmethod
    def pack(cls, robot: str, boot: str, version: int, marks: Iterable[Mark]) -> Self:
        """Return the message of the marks of a run."""
        packed = tuple(WireMark.pack(mark) for mark in marks)
        return cls(robot=robot, boot=boot, version=version, marks=packed)

    @model_validator(mode="after")
    def _check(self) -> Self:
        if len({mark.id for mark in self.marks}) < len(self.marks):
            raise ValueError("marks, expected each once")
        return self

    def unpack(self) -> tuple[Mark, ...]:
        """Return the marks."""
        return tuple(mark.unpack() for mark in self.marks)


class WirePlacedMark(WireModel):
    """A mark where it lies in a joint component; fields as of `mapweave.marks.PlacedMark`."""

    id: Id
    label: Label
    by: Id
    time: Number
    component: ComponentName
    x: JointMetres
    y: JointMetres

    @classmethod
    def pack(cls, mark: PlacedMark) -> Self:
        """Return `mark` for the wire."""
        x, y = (round(float(number), 4) for number in mark.position)
        return cls(
            id=mark.id, label=mark.label, by=mark.by, time=round(float(mark.time), 3),
            component=mark.component, x=x, y=y,
        )  # fmt: skip

    def unpack(self) -> PlacedMark:
        """Return the mark."""
        place = np.array([self.x, self.y])
        return PlacedMark(self.id, self.label, self.by, self.time, self.component, place)
