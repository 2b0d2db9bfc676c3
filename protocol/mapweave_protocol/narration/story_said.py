"""What people and programs say of the joint map, told when it is new: marks, and orders."""

from collections.abc import Iterator

import numpy as np

from mapweave.maps import JointMap
from mapweave.marks import PlacedMark
from mapweave.orders import Order, OrderEffect, OrderKind

_DONE = {
    OrderKind.MARK: "marks",
    OrderKind.PIN: "pins",
    OrderKind.FORBID: "forbids",
    OrderKind.FORGET: "forgets",
}
_NOT_DONE = {
    OrderEffect.IN_FORCE: "",
    OrderEffect.WAITS: "; it waits, as that is not here",
    OrderEffect.OUTRANKED: "; later orders outrank it",
}
NOTABLE = 0.5  # [m] by which a mark has moved that is worth a line


class SaidStory:
    """Tells of marks and orders."""

    def __init__(self) -> None:
        self._marks: dict[str, tuple[PlacedMark, str]] = {}  # by id, with the frame it is in
        self._orders: dict[str, Order] = {}

    def changed(self, joint: JointMap) -> Iterator[str]:
        """Tell what is new in a version."""
        yield from self._tell_orders(joint)
        yield from self._tell_marks(joint)

    def _tell_orders(self, joint: JointMap) -> Iterator[str]:
        before, self._orders = self._orders, {order.id: order for order in joint.orders}
        for order in joint.orders:
            known = before.get(order.id)
            if known is None or known.effect is not order.effect:
                yield f"{_tell(order)}: {order.reason}{_NOT_DONE[order.effect]}"
        for order in before.values():
            if order.id not in self._orders:
                yield f"taken back: {_tell(order)}"

    def _tell_marks(self, joint: JointMap) -> Iterator[str]:
        before = self._marks
        self._marks = {
            mark.id: (mark, min(component.robots))
            for component in joint.components
            for mark in component.marks
        }
        for mark, frame in self._marks.values():
            known = before.get(mark.id)
            if known is None or known[1] != frame or _moved(known[0], mark):
                x, y = mark.position
                what = "marks" if known is None else "has a mark moved:"
                yield f"{mark.by} {what} {mark.label!r} at {x:.1f}, {y:.1f} m of {frame}"
        for mark, _ in before.values():
            if mark.id not in self._marks:
                yield f"no longer marked: {mark.label!r} by {mark.by}"


def _moved(before: PlacedMark, now: PlacedMark) -> bool:
    return float(np.hypot(*(now.position - before.position))) >= NOTABLE


def _tell(order: Order) -> str:
    if order.kind is OrderKind.FORGET:
        return f"{order.by} {_DONE[order.kind]} {order.robot}@{', '.join(order.boots)}"
    return f"{order.by} {_DONE[order.kind]} {order.reference} and {order.other}"
