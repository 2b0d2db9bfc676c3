"""``mapweave pin`` and ``mapweave forbid``: what a person says of how two components lie."""

import argparse
import time
from functools import partial

import zenoh

from mapweave.cli import Command, argument
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.maps import Alignment
from mapweave.orders import OrderKind
from mapweave_protocol.operator.arguments import (
    add_order_arguments,
    add_reason_argument,
    component,
    connected,
    transform,
)
from mapweave_protocol.operator.delivery import (
    OrderError,
    deliver,
    latest_joint_map,
    maps_of,
    orders_of,
)
from mapweave_protocol.operator.making import order_between
from mapweave_protocol.operator.told import tell
from mapweave_protocol.wire.messages import OrderMessage
from mapweave_protocol.wire.orders.order_message import in_force, taking_back

_DONE = {OrderKind.PIN: "pinned", OrderKind.FORBID: "forbidden"}


def _configure(parser: argparse.ArgumentParser, kind: OrderKind) -> None:
    parser.add_argument("reference", metavar="A", type=argument(component), help="such as r1/0")
    parser.add_argument("other", metavar="B", type=argument(component), help="such as r2/0")
    anything = {OrderKind.PIN: "what was found", OrderKind.FORBID: "any"}
    parser.add_argument(
        "--transform",
        metavar="X,Y,DEGREES",
        type=argument(transform),
        help=f"where B lies in the frame of A [m, m, °] (default {anything[kind]})",
    )
    add_reason_argument(parser)
    add_order_arguments(parser, f"what was {_DONE[kind]} between the two")


def _run(options: argparse.Namespace, kind: OrderKind) -> int:
    pair = options.reference, options.other
    if options.reference == options.other:
        raise OrderError(f"{options.reference}: expected two components, given one twice")
    with connected(options) as (session, team, name, sign):
        if options.undo:
            orders = _undone(session, team, kind, pair, name, options.reason)
        else:
            maps = maps_of(session, team, pair)
            meant = options.transform
            if meant is None and kind is OrderKind.PIN:
                meant = found_between(latest_joint_map(session, team).alignments, pair)
            orders = [
                order_between(kind, maps, meant, by=name, reason=options.reason, time=time.time())
            ]
        deliver(session, team, [sign(order) for order in orders])
    for order in orders:
        done = "taken back" if options.undo else _DONE[kind]
        tell(options, order, f"{' and '.join(pair)}: {done}", components=pair)
    return 0


def found_between(alignments: tuple[Alignment, ...], pair: tuple[str, str]) -> FloatArray:
    """Return (3,) how the other of a pair was found to lie in its reference [m, m, rad].

    Raises
    ------
    OrderError
        If nothing was found.
    """
    for a in alignments:
        if (a.reference, a.other) == pair and not a.evidence.is_empty:
            return a.transform
        if (a.other, a.reference) == pair and not a.evidence.is_empty:
            return se2.inverse(a.transform)
    raise OrderError(
        f"nothing was found between {pair[0]} and {pair[1]} that could be confirmed:"
        " say how they lie with --transform X,Y,DEGREES"
    )


def _undone(
    session: zenoh.Session,
    team: str,
    kind: OrderKind,
    pair: tuple[str, str],
    name: str,
    reason: str,
) -> list[OrderMessage]:
    """Return what takes back the orders about a pair, by the names they had or have."""
    meant = set(pair)
    held = orders_of(session, team)
    now = {
        order.id
        for order in latest_joint_map(session, team).orders
        if order.kind is kind and {order.reference, order.other} == meant
    }
    found = [
        order
        for order in in_force(held)
        if order.kind is kind
        and (order.id in now or {end.component for end in order.ends} == meant)
    ]
    if not found:
        raise OrderError(f"nothing {_DONE[kind]} between {pair[0]} and {pair[1]} is in force")
    return [taking_back(order, name, time.time(), reason) for order in found]


pin = Command(
    "Say that two components lie as found, or as given.",
    partial(_configure, kind=OrderKind.PIN),
    partial(_run, kind=OrderKind.PIN),
    "r1/0 r2/0 --reason 'seen from the door' --team rescue",
)
forbid = Command(
    "Say that two components may not be joined.",
    partial(_configure, kind=OrderKind.FORBID),
    partial(_run, kind=OrderKind.FORBID),
    "r1/0 r2/0 --reason 'two like floors' --team rescue",
)
