"""``mapweave forget``: what a robot mapped leaves the joint map."""

import argparse
import time

import zenoh

from mapweave.cli import Command, argument
from mapweave.errors import InvalidIdError
from mapweave.ids import check_id
from mapweave.orders import OrderKind
from mapweave_protocol.operator.arguments import (
    add_order_arguments,
    add_reason_argument,
    connected,
)
from mapweave_protocol.operator.delivery import OrderError, deliver, orders_of, runs_of, whose_maps
from mapweave_protocol.operator.told import tell
from mapweave_protocol.wire.messages import OrderMessage
from mapweave_protocol.wire.orders.order_message import in_force, new_order_id, taking_back


def _configure(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "runs",
        metavar="ROBOT[@BOOT]",
        type=argument(_robot_and_boot),
        help="all runs of a robot that there are by now, or one of them; what it maps in a later"
        " run stays. Nothing is deleted",
    )
    add_reason_argument(parser)
    add_order_arguments(parser, "that these runs are to be forgotten")


def _run(options: argparse.Namespace) -> int:
    robot, boot = options.runs
    with connected(options) as (session, team, name, sign):
        boots = _boots(session, team, robot, boot)
        if options.undo:
            orders = _undone(session, team, robot, boots, name, options.reason)
        else:
            orders = [
                OrderMessage(
                    id=new_order_id(),
                    kind=OrderKind.FORGET,
                    by=name,
                    time=time.time(),
                    reason=options.reason,
                    robot=robot,
                    boots=boots,
                )
            ]
        deliver(session, team, [sign(order) for order in orders])
    for order in orders:
        done = "taken back" if options.undo else f"forgotten: {', '.join(boots)}"
        tell(options, order, f"{robot}: {done}", robot=robot, boots=boots)
    return 0


def _boots(session: zenoh.Session, team: str, robot: str, boot: str | None) -> tuple[str, ...]:
    """Return the runs that are meant.

    Raises
    ------
    OrderError
        If there are none.
    """
    held = runs_of(session, team)
    boots = tuple(run.boot for run in held if run.robot == robot)
    if boot is None and boots:
        return boots
    if boot in boots:
        return (boot,)
    none = f"there is no map of it; the coordinator has {whose_maps(held)}"
    there = f"its runs are {', '.join(boots)}" if boots else none
    raise OrderError(f"{robot}@{boot}: {there}" if boot else f"{robot}: {there}")


def _undone(
    session: zenoh.Session, team: str, robot: str, boots: tuple[str, ...], name: str, reason: str
) -> list[OrderMessage]:
    found = [
        order
        for order in in_force(orders_of(session, team))
        if order.kind is OrderKind.FORGET
        and order.robot == robot
        and not set(order.boots).isdisjoint(boots)
    ]
    if not found:
        raise OrderError(f"no order to forget {robot} is in force; expected one to take back")
    return [taking_back(order, name, time.time(), reason) for order in found]


def _robot_and_boot(text: str) -> tuple[str, str | None]:
    robot, at, boot = text.partition("@")
    try:
        return check_id("robot", robot), check_id("boot", boot) if at else None
    except InvalidIdError as error:
        raise ValueError(str(error)) from error


command = Command(
    "Take what a robot mapped out of the joint map.",
    _configure,
    _run,
    "r1 --reason 'its laser was loose' --team rescue",
)
