"""What a person orders on the page: pin and forbid joins, and take orders back.

The guard has checked before that the request is of this server's page, or of a program that knows
the token. The coordinator takes an order as if it had come over the network.
"""

import time
from collections.abc import Callable, Mapping
from typing import Annotated, Literal, TypeAlias

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError
from starlette.concurrency import run_in_threadpool
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Route

from mapweave.errors import MapweaveError
from mapweave.geometry.arrays import FloatArray
from mapweave.maps import JointMap, RobotMap, component_name
from mapweave.orders import MAX_REASON, Order, OrderKind
from mapweave.text import in_words
from mapweave_fusion_server.web.access.member import operator_of
from mapweave_fusion_server.web.knowledge import Knowledge
from mapweave_protocol.operator.joins import found_between
from mapweave_protocol.operator.making import order_between
from mapweave_protocol.wire.messages import OrderMessage
from mapweave_protocol.wire.model import ComponentName, Id, Sentence, Transform
from mapweave_protocol.wire.orders.order_message import new_order_id

MAX_BODY = 4096  # [bytes]
_Reason: TypeAlias = Annotated[Sentence, Field(min_length=1, max_length=MAX_REASON)]


class _Wish(BaseModel):
    """What the page asks for."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    by: Id
    reason: _Reason


class JoinWish(_Wish):
    """A pin or a ban; without a transform a pin is of what was found, a ban of any."""

    kind: Literal["pin", "forbid"]
    reference: ComponentName
    other: ComponentName
    transform: Transform | None = None


class UndoWish(_Wish):
    """To take back an order that is in force."""

    takes_back: Id


class PageOrders:
    """Answers those who order something.

    Parameters
    ----------
    knowledge
        What orders are about, and the feed that takes them to the coordinator.
    clock
        Returns the time [s since 1970].
    """

    def __init__(self, knowledge: Knowledge, clock: Callable[[], float] = time.time) -> None:
        self._known = knowledge
        self._clock = clock

    @property
    def routes(self) -> list[Route]:
        """What can be asked for, and by whom it is answered."""
        return [
            Route("/api/orders", self._order, methods=["POST"]),
            Route("/api/me", self._me),
        ]

    async def _order(self, request: Request) -> Response:
        wish = _wish_of(await _body_of(request))
        operator = operator_of(request)
        if operator not in (None, wish.by):
            raise HTTPException(403, f"by: expected {operator}, whose certificate it is")
        try:
            order = await run_in_threadpool(self._made, wish)
        except MapweaveError as error:
            raise HTTPException(409, str(error)) from error
        if not self._known.feed.give_order(order):
            raise HTTPException(503, "too many orders wait already")
        return JSONResponse({"id": order.id}, 202)

    async def _me(self, request: Request) -> Response:
        """Answer with the operator that the sender's certificate is of."""
        content = {"operator": operator_of(request)}
        return JSONResponse(content, headers={"Cache-Control": "no-store"})

    def _made(self, wish: JoinWish | UndoWish) -> OrderMessage:
        joint = self._known.history.joint(self._known.history.latest)
        if isinstance(wish, UndoWish):
            return self._taking_back(joint, wish)
        pair = wish.reference, wish.other
        maps = {name: self._map_of(name) for name in pair}
        if len(maps) < 2:
            raise HTTPException(400, f"{wish.other}: expected two components")
        return order_between(
            OrderKind(wish.kind),
            maps,
            _meant(wish, joint),
            by=wish.by,
            reason=wish.reason,
            time=self._clock(),
        )

    def _taking_back(self, joint: JointMap | None, wish: UndoWish) -> OrderMessage:
        orders: Mapping[str, Order] = {} if joint is None else {o.id: o for o in joint.orders}
        if wish.takes_back not in orders:
            raise HTTPException(404, f"no order {wish.takes_back} is in force")
        return OrderMessage(
            id=new_order_id(),
            kind=orders[wish.takes_back].kind,
            by=wish.by,
            time=self._clock(),
            reason=wish.reason,
            takes_back=wish.takes_back,
        )

    def _map_of(self, name: str) -> RobotMap:
        for robot_map in self._known.feed.seen.maps:
            if name in {component_name(robot_map.robot, c) for c in robot_map.components}:
                return robot_map
        raise HTTPException(404, f"no map of component {name} is here now")


def _meant(wish: JoinWish, joint: JointMap | None) -> FloatArray | None:
    """Return the (3,) transform that is pinned or forbidden; None for any."""
    if wish.transform is not None:
        return np.array(wish.transform)
    if wish.kind == "forbid":
        return None
    alignments = () if joint is None else joint.alignments
    return found_between(alignments, (wish.reference, wish.other))


async def _body_of(request: Request) -> bytes:
    """Return the body of a request, if it is JSON and short."""
    kind = request.headers.get("content-type", "").partition(";")[0].strip().lower()
    if kind != "application/json":
        raise HTTPException(415, "expected application/json")
    body = b""
    async for part in request.stream():
        body += part
        if len(body) > MAX_BODY:
            raise HTTPException(413, f"expected at most {MAX_BODY} bytes")
    return body


def _wish_of(body: bytes) -> JoinWish | UndoWish:
    """Return what `body` asks for."""
    kind = UndoWish if b'"takes_back"' in body else JoinWish
    try:
        return kind.model_validate_json(body)
    except ValidationError as error:
        first = error.errors(include_url=False, include_context=False, include_input=False)[0]
        place = ".".join(str(part) for part in first["loc"])
        raise HTTPException(400, f"{place or 'order'}: {in_words(first)}") from error
