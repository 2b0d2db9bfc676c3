"""Orders made of what a person says and of the maps that it is about; no network in here."""

from collections.abc import Mapping

import numpy as np

from mapweave.anchors import anchor_of, anchored, find, tied
from mapweave.errors import ArgumentError
from mapweave.geometry.arrays import FloatArray
from mapweave.maps import RobotMap, Submap, component_name, parse_component
from mapweave.marks import Anchor
from mapweave.orders import OrderKind
from mapweave_protocol.wire.messages import OrderMessage
from mapweave_protocol.wire.model import Transform, to_transform
from mapweave_protocol.wire.orders.order_message import WireEnd, new_order_id


def order_between(
    kind: OrderKind,
    maps: Mapping[str, RobotMap],
    transform: FloatArray | None,
    *,
    by: str,
    reason: str,
    time: float,
) -> OrderMessage:
    """Return a pin or a ban of two components.

    Parameters
    ----------
    maps
        The components' names, reference and other, with the map that each is of.
    transform
        (3,) takes coordinates in the other to coordinates in the reference [m, m, rad]; None where
        any is meant.

    Raises
    ------
    ArgumentError
        If a map does not have its component.
    """
    ours, theirs = (submaps_of(robot_map, name) for name, robot_map in maps.items())
    between: Transform | None = None
    anchors = anchor_of(ours[0]), anchor_of(theirs[0])
    if transform is not None:
        *tie, step = tied(ours, theirs, transform)
        anchors, between = (tie[0], tie[1]), to_transform(step)
    ends = tuple(
        _end(robot_map, name, anchor)
        for (name, robot_map), anchor in zip(maps.items(), anchors, strict=True)
    )
    return OrderMessage(
        id=new_order_id(), kind=kind, by=by, time=time, reason=reason, ends=ends, transform=between
    )


def mark_at_scan(robot_map: RobotMap, scan: int, label: str, by: str, time: float) -> OrderMessage:
    """Return a mark where the sensor was at a scan.

    Raises
    ------
    ArgumentError
        If the scan is not in the map.
    """
    anchor = Anchor(0, scan)
    held = find(robot_map.submaps, anchor)
    if held is None:
        raise ArgumentError("--at", f"scan {scan} is not in the map of {robot_map.robot}")
    name = component_name(robot_map.robot, held[0].component)
    return _marked(robot_map, name, Anchor(held[0].id, scan), np.zeros(2), label, by, time)


def mark_at(
    robot_map: RobotMap, component: str, place: FloatArray, label: str, by: str, time: float
) -> OrderMessage:
    """Return a mark at (2,) `place` [m] in the frame of `component`.

    Raises
    ------
    ArgumentError
        If the map does not have the component.
    """
    submaps = submaps_of(robot_map, component)
    found = anchored(submaps, submaps[0].component, place)
    if found is None:
        raise ArgumentError("--at", f"nothing of {component} holds a mark")
    return _marked(robot_map, component, *found, label, by, time)


def submaps_of(robot_map: RobotMap, component: str) -> list[Submap]:
    """Return the submaps of a component, at least one.

    Raises
    ------
    ArgumentError
        If there are none.
    """
    _, number = parse_component(component)
    found = [submap for submap in robot_map.submaps if submap.component == number]
    if not found:
        there = ", ".join(component_name(robot_map.robot, c) for c in robot_map.components)
        raise ArgumentError(
            "component", f"no {component} by now; the run that it was of has {there}"
        )
    return found


def _marked(
    robot_map: RobotMap,
    component: str,
    anchor: Anchor,
    place: FloatArray,
    label: str,
    by: str,
    time: float,
) -> OrderMessage:
    x, y = (float(number) for number in place)
    return OrderMessage(
        id=new_order_id(),
        kind=OrderKind.MARK,
        by=by,
        time=time,
        reason="marked",
        ends=(_end(robot_map, component, anchor),),
        transform=(x, y, 0.0),
        label=label,
    )


def _end(robot_map: RobotMap, component: str, anchor: Anchor) -> WireEnd:
    return WireEnd(
        robot=robot_map.robot,
        boot=robot_map.boot,
        component=component,
        submap=anchor.submap,
        scan=anchor.scan,
    )
