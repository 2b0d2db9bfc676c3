"""``mapweave mark``: a labelled point on what a robot has mapped."""

import argparse
import time

import zenoh

from mapweave.cli import Command, argument
from mapweave.maps import RobotMap, component_name
from mapweave.marks import MAX_LABEL
from mapweave.orders import OrderKind
from mapweave_protocol.operator.arguments import (
    add_order_arguments,
    component,
    connected,
    scan_or_place,
)
from mapweave_protocol.operator.delivery import OrderError, deliver, maps_of, orders_of
from mapweave_protocol.operator.making import mark_at, mark_at_scan
from mapweave_protocol.operator.told import tell
from mapweave_protocol.wire.messages import OrderMessage
from mapweave_protocol.wire.orders.order_message import in_force, taking_back


def _configure(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "robot",
        metavar="ROBOT",
        type=argument(_robot_or_component),
        help="whose map the mark is on, such as r1, where it is now, or r1/0",
    )
    parser.add_argument("label", metavar="LABEL", type=argument(_label), help="such as victim")
    parser.add_argument(
        "--at",
        metavar="SCAN|X,Y",
        type=argument(scan_or_place),
        help="where the robot was at a scan, or a place in the frame of its own map [m]",
    )
    add_order_arguments(parser, "the marks of this label that operators made on this robot's map")


def _run(options: argparse.Namespace) -> int:
    if (options.at is None) != options.undo:
        raise OrderError("expected --at SCAN or --at=X,Y, or --undo in its place")
    with connected(options) as (session, team, name, sign):
        if options.undo:
            orders = _undone(session, team, options, name)
        else:
            [robot_map] = maps_of(session, team, [options.robot]).values()
            orders = [_made(robot_map, options, name)]
        deliver(session, team, [sign(order) for order in orders])
    for order in orders:
        on = options.robot if options.undo else order.ends[0].component
        done = "taken back" if options.undo else f"marked on {on}"
        tell(options, order, f"{options.label}: {done}", on=on, label=options.label)
    return 0


def _made(robot_map: RobotMap, options: argparse.Namespace, name: str) -> OrderMessage:
    if isinstance(options.at, int):
        return mark_at_scan(robot_map, options.at, options.label, name, time.time())
    return mark_at(
        robot_map, _frame(robot_map, options.robot), options.at, options.label, name, time.time()
    )


def _frame(robot_map: RobotMap, name: str) -> str:
    """Return the component meant: of a robot, that in which it is."""
    return name if "/" in name else component_name(name, robot_map.submaps[-1].component)


def _undone(
    session: zenoh.Session, team: str, options: argparse.Namespace, name: str
) -> list[OrderMessage]:
    robot = options.robot.partition("/")[0]
    meant = [
        order
        for order in in_force(orders_of(session, team))
        if order.kind is OrderKind.MARK
        and order.label == options.label
        and order.ends[0].robot == robot
    ]
    if not meant:
        raise OrderError(f"no operator's mark {options.label!r} on the map of {robot} is in force")
    return [taking_back(order, name, time.time(), "taken back") for order in meant]


def _robot_or_component(text: str) -> str:
    component(text if "/" in text else f"{text}/0")
    return text


def _label(text: str) -> str:
    if not (text.isprintable() and 0 < len(text) <= MAX_LABEL):
        raise ValueError(f"expected a label of 1 to {MAX_LABEL} printable characters")
    return text


command = Command(
    "Mark a place on a robot's map, such as a victim.",
    _configure,
    _run,
    "r1 victim --at 3.5,1.2 --team rescue",
)
