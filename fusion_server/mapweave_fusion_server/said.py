"""What people and programs say beside the maps: marks and orders, as the coordinator holds them.

Orders hold on to scans of runs; here they become orders about components, as these are named now.
No clock, no network.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from mapweave.anchors import find
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.maps import RobotMap, Submap, component_name
from mapweave.marks import Mark
from mapweave.orders import Order, OrderEffect, OrderKind
from mapweave_protocol.link.order_ledger import OrderLedger
from mapweave_protocol.wire.messages import MapVersion, MarksMessage, OrderMessage
from mapweave_protocol.wire.orders.order_message import WireEnd
from mapweave_protocol.wire.pairs import Run

Maps = Mapping[Run, RobotMap]


class Said:
    """The marks of all runs, and the orders of all operators."""

    def __init__(self) -> None:
        self.ledger = OrderLedger()
        self._marks: dict[Run, MarksMessage] = {}

    def take_marks(self, message: MarksMessage) -> bool:
        """Take the marks of a run; return whether they are news."""
        run = message.robot, message.boot
        known = self._marks.get(run)
        if known is not None and known.version >= message.version:
            return False
        self._marks[run] = message
        return True

    @property
    def marks_held(self) -> tuple[MapVersion, ...]:
        """Which version of the marks of each run is here."""
        return tuple(
            MapVersion(robot=robot, boot=boot, version=self._marks[robot, boot].version)
            for robot, boot in sorted(self._marks)
        )

    def without_forgotten(self, maps: Maps) -> dict[Run, RobotMap]:
        """Return `maps` but for those of runs that are to be forgotten."""
        forgotten = {
            (order.robot, boot)
            for order in self.ledger.in_force
            if order.kind is OrderKind.FORGET
            for boot in order.boots
        }
        return {run: robot_map for run, robot_map in maps.items() if run not in forgotten}

    def marked(self, maps: Maps) -> dict[Run, RobotMap]:
        """Return `maps` with what was marked on them, by robots and by operators."""
        marks = {run: list(message.unpack()) for run, message in self._marks.items()}
        for order in self.ledger.in_force:
            if order.kind is OrderKind.MARK:
                [end] = order.ends
                marks.setdefault((end.robot, end.boot), []).append(_mark(order, end))
        return {
            run: replace(robot_map, marks=tuple(marks[run])) if run in marks else robot_map
            for run, robot_map in maps.items()
        }

    def orders(self, maps: Maps, shown: Maps) -> tuple[Order, ...]:
        """Return what was ordered but for marks, about components as they are named now.

        Parameters
        ----------
        maps
            All there are.
        shown
            Without those of forgotten runs.
        """
        wanted = (o for o in self.ledger.in_force if o.kind is not OrderKind.MARK)
        return tuple(_order(order, maps, shown) for order in wanted)


def _mark(order: OrderMessage, end: WireEnd) -> Mark:
    if order.label is None or order.transform is None:
        raise ValueError(f"order {order.id}: expected a label and a place")
    place = np.array(order.transform[:2])
    return Mark(order.id, order.label, order.by, order.time, end.anchor, place)


def _order(order: OrderMessage, maps: Maps, shown: Maps) -> Order:
    told = Order(order.id, order.kind, order.by, order.time, order.reason)
    if order.kind is OrderKind.FORGET:
        robot = order.robot or ""
        known = any((robot, boot) in maps for boot in order.boots)
        effect = OrderEffect.IN_FORCE if known else OrderEffect.WAITS
        return replace(told, robot=robot, boots=order.boots, effect=effect)
    ends = [_held(end, shown) for end in order.ends]
    names = [
        end.component if held is None else component_name(shown[_run(end)].robot, held.component)
        for end, held in zip(order.ends, ends, strict=True)
    ]
    told = replace(told, reference=names[0], other=names[1])
    if ends[0] is None or ends[1] is None:
        return replace(told, effect=OrderEffect.WAITS)
    return replace(told, transform=_transform(order, ends[0], ends[1]))


def _held(end: WireEnd, maps: Maps) -> Submap | None:
    """Return the submap that an order holds on to, None where it is not there."""
    robot_map = maps.get(_run(end))
    found = None if robot_map is None else find(robot_map.submaps, end.anchor)
    return None if found is None else found[0]


def _transform(order: OrderMessage, ours: Submap, theirs: Submap) -> FloatArray | None:
    """Return (3,) from the other component to the reference, of an order between submaps."""
    if order.transform is None:
        return None
    there = se2.compose(ours.pose, order.transform)
    return se2.compose(there, se2.inverse(theirs.pose))


def _run(end: WireEnd) -> Run:
    return end.robot, end.boot
