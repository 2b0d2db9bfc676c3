"""Orders to the coordinator, and what an order is about from there."""

import time
from collections.abc import Sequence

import zenoh

from mapweave.errors import MapweaveError
from mapweave.maps import JointMap, RobotMap
from mapweave_protocol.link.asking import (
    ask_latest,
    ask_map_of_component,
    ask_orders,
    ask_robot_map,
)
from mapweave_protocol.link.assembler import MapAssembler
from mapweave_protocol.wire.codec import encode
from mapweave_protocol.wire.keys import ORDER
from mapweave_protocol.wire.messages import MapMessage, OrderMessage

PATIENCE = 10.0  # [s] for a router, and for a coordinator
PAUSE = 0.2  # [s] between two tries


class OrderError(MapweaveError):
    """An order that cannot be given, or that nobody has taken."""


def deliver(session: zenoh.Session, team: str, orders: Sequence[OrderMessage]) -> None:
    """Have the coordinator take `orders`; returns when it has them in its store.

    Raises
    ------
    OrderError
        If it has not for some time.
    """
    wanted = {order.id for order in orders}
    deadline = time.monotonic() + PATIENCE
    while time.monotonic() < deadline:
        for order in orders:
            key = ORDER.build(team=team, name=order.by, order=str(order.kind))
            session.put(key, encode(order))
        held = ask_orders(session, team, PAUSE * 10) or []
        if wanted <= {order.id for order in held}:
            return
        time.sleep(PAUSE)
    raise OrderError(
        f"no coordinator of team {team} has taken the order within {PATIENCE:g} s;"
        " is one running? Robots that are here keep it for one"
    )


def orders_of(session: zenoh.Session, team: str) -> list[OrderMessage]:
    """Return all orders there are.

    Raises
    ------
    OrderError
        If no coordinator answers.
    """
    held = ask_orders(session, team)
    if held is None:
        raise OrderError(_silent(team))
    return held


def latest_joint_map(session: zenoh.Session, team: str) -> JointMap:
    """Return the latest joint map.

    Raises
    ------
    OrderError
        If there is none.
    """
    message, answered = ask_latest(session, team)
    if not answered:
        raise OrderError(_silent(team))
    if message is None:
        raise OrderError(f"there is no joint map of team {team} yet")
    return message.unpack()


def map_of(session: zenoh.Session, team: str, name: str) -> RobotMap:
    """Return the map of the run that a component is of, or of a robot's last run.

    Parameters
    ----------
    name
        Such as ``r1/0``, or ``r1``.

    Raises
    ------
    OrderError
        If nobody knows it.
    """
    ask = ask_map_of_component if "/" in name else ask_robot_map
    message: MapMessage | None = ask(session, team, name)
    robot_map = None if message is None else MapAssembler().update(message)
    if robot_map is None or not robot_map.submaps:
        raise OrderError(f"no coordinator of team {team} has a map of {name}")
    return robot_map


def _silent(team: str) -> str:
    return f"no coordinator of team {team} answers; is one running?"
