"""Orders to the coordinator, and what an order is about from there."""

import time
from collections.abc import Callable, Sequence
from typing import TypeVar

import zenoh

from mapweave.errors import MapweaveError
from mapweave.maps import JointMap, RobotMap
from mapweave_protocol.link.asking import (
    ANSWER_WITHIN,
    ask_latest,
    ask_map_of_component,
    ask_orders,
    ask_robot_map,
    ask_runs,
)
from mapweave_protocol.link.assembler import MapAssembler
from mapweave_protocol.wire.codec import encode
from mapweave_protocol.wire.keys import ORDER
from mapweave_protocol.wire.messages import MapMessage, OrderMessage
from mapweave_protocol.wire.orders.runs_message import WireRun

PATIENCE = 10.0  # [s] for a router, and for a coordinator
PAUSE = 0.2  # [s] between two tries

T = TypeVar("T")


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
        If no coordinator answers for some time.
    """
    return _answer(team, lambda seconds: ask_orders(session, team, seconds))


def runs_of(session: zenoh.Session, team: str) -> list[WireRun]:
    """Return the runs that the coordinator holds, of all robots.

    Raises
    ------
    OrderError
        If none answers for some time.
    """
    return _answer(team, lambda seconds: ask_runs(session, team, seconds))


def latest_joint_map(session: zenoh.Session, team: str) -> JointMap:
    """Return the latest joint map.

    Raises
    ------
    OrderError
        If there is none.
    """
    message, _ = ask_latest(session, team)
    if message is None:
        raise OrderError(f"there is no joint map of team {team} yet")
    return message.unpack()


def maps_of(session: zenoh.Session, team: str, names: Sequence[str]) -> dict[str, RobotMap]:
    """Return by name the map of the run that a component is of, or of a robot's last run.

    Parameters
    ----------
    names
        Such as ``r1/0``, or ``r1``.

    Raises
    ------
    OrderError
        If no coordinator answers for some time, or it does not know one of them.
    """
    runs = runs_of(session, team)  # so that no answer later on means that there is none
    return {name: _map_of(session, team, name, runs) for name in names}


def whose_maps(runs: Sequence[WireRun]) -> str:
    """Return of whom there are maps, in words."""
    robots = sorted({run.robot for run in runs})
    return f"maps of {', '.join(robots)}" if robots else "none of anybody yet"


def _map_of(session: zenoh.Session, team: str, name: str, runs: Sequence[WireRun]) -> RobotMap:
    ask = ask_map_of_component if "/" in name else ask_robot_map
    message: MapMessage | None = ask(session, team, name)
    robot_map = None if message is None else MapAssembler().update(message)
    if robot_map is None or not robot_map.submaps:
        raise OrderError(
            f"no coordinator of team {team} has a map of {name}; it has {whose_maps(runs)}"
        )
    return robot_map


def _answer(team: str, ask: Callable[[float], T | None]) -> T:
    """Return what a coordinator answers, None being no answer; one may be just starting.

    Parameters
    ----------
    ask
        Given how long it may take [s].
    """
    deadline = time.monotonic() + PATIENCE
    while (left := deadline - time.monotonic()) > 0:
        answer = ask(min(left, ANSWER_WITHIN))
        if answer is not None:
            return answer
        time.sleep(PAUSE)
    raise OrderError(
        f"no coordinator of team {team} answered within {PATIENCE:g} s; is one running,"
        " and is that the team (--team)?"
    )
