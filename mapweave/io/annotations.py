"""What people have said of a map, as it stands in files: marks on it, and operators' orders."""

from collections.abc import Iterable
from typing import Annotated, Any, TypeAlias

import numpy as np
from pydantic import AfterValidator, Field, StringConstraints

from mapweave.geometry.arrays import FloatArray
from mapweave.io.file_types import ComponentName, Count, FileModel, Metre, Pose, RobotId
from mapweave.marks import MAX_LABEL, Anchor, Mark, PlacedMark
from mapweave.orders import Order, OrderEffect, OrderKind


def _printable(text: str) -> str:
    """Refuse what would move the cursor of a terminal that shows it."""
    if not text.isprintable():
        raise ValueError("expected printable text")
    return text


_Label: TypeAlias = Annotated[
    str, StringConstraints(min_length=1, max_length=MAX_LABEL), AfterValidator(_printable)
]
_METRES, _RADIANS, _SECONDS = 4, 6, 3  # decimals


class _MarkFile(FileModel):
    """What marks have in common, on a robot's map and on a joint one."""

    id: RobotId
    label: _Label
    by: RobotId
    time: float


class MarkFile(_MarkFile):
    """One of the ``marks`` of a map file."""

    submap: Count
    scan: Count | None
    position: tuple[Metre, Metre]

    def to_mark(self) -> Mark:
        """Return it as the library's value."""
        anchor = Anchor(self.submap, self.scan)
        place = np.array(self.position, dtype=np.float64)
        return Mark(self.id, self.label, self.by, self.time, anchor, place)


class PlacedMarkFile(_MarkFile):
    """One of the ``marks`` of a joint component."""

    component: ComponentName
    position: tuple[Metre, Metre]

    def to_mark(self) -> PlacedMark:
        """Return it as the library's value."""
        place = np.array(self.position, dtype=np.float64)
        return PlacedMark(self.id, self.label, self.by, self.time, self.component, place)


class OrderFile(FileModel):
    """One of the ``orders`` of a joint map file."""

    id: RobotId
    kind: OrderKind
    by: RobotId
    time: float
    reason: str
    effect: OrderEffect
    reference: ComponentName | None = None
    other: ComponentName | None = None
    transform: Pose | None = None
    robot: RobotId | None = None
    boots: list[str] = Field(default_factory=list)

    def to_order(self) -> Order:
        """Return it as the library's value."""
        return Order(
            id=self.id,
            kind=self.kind,
            by=self.by,
            time=self.time,
            reason=self.reason,
            reference=self.reference or "",
            other=self.other or "",
            transform=None if self.transform is None else np.array(self.transform),
            robot=self.robot or "",
            boots=tuple(self.boots),
            effect=self.effect,
        )


def listed(field: str, content: Iterable[dict[str, object]]) -> dict[str, object]:
    """Return `field` with what it lists; no field where there is nothing."""
    found = list(content)
    return {field: found} if found else {}


def mark_content(mark: Mark) -> dict[str, object]:
    """Return one of the ``marks`` of a robot's map."""
    held_by = {"submap": mark.anchor.submap, "scan": mark.anchor.scan}
    return {**_said(mark), **held_by, "position": _metres(mark.position)}


def placed_mark_content(mark: PlacedMark) -> dict[str, object]:
    """Return one of the ``marks`` of a joint component."""
    return {**_said(mark), "component": mark.component, "position": _metres(mark.position)}


def order_content(order: Order) -> dict[str, object]:
    """Return one of the ``orders`` of a joint map."""
    content: dict[str, object] = {
        "id": order.id,
        "kind": order.kind,
        "by": order.by,
        "time": round(order.time, _SECONDS),
        "reason": order.reason,
        "effect": order.effect,
    }
    if order.robot:
        return {**content, "robot": order.robot, "boots": list(order.boots)}
    ends = {"reference": order.reference, "other": order.other}
    return {**content, **ends, "transform": _transform(order.transform)}


def _said(mark: Mark | PlacedMark) -> dict[str, object]:
    time = round(mark.time, _SECONDS)
    return {"id": mark.id, "label": mark.label, "by": mark.by, "time": time}


def _transform(transform: FloatArray | None) -> list[float] | None:
    if transform is None:
        return None
    x, y, theta = transform.tolist()
    return [round(x, _METRES), round(y, _METRES), round(theta, _RADIANS)]


def _metres(position: FloatArray) -> list[Any]:
    return list(np.round(position, _METRES).tolist())
