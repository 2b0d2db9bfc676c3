"""What a person orders, as a message: a mark, a pin, a ban, runs to forget; and taking it back.

An order is never changed: it has an id, and to hear it twice is to hear it once. It is taken back
by another one that names it. So whoever has the same orders agrees on which are in force, in
whatever order they came.
"""

import hashlib
import secrets
from collections.abc import Iterable, Sequence
from typing import Annotated, ClassVar, Self

import numpy as np
from pydantic import Field, model_validator

from mapweave.marks import Anchor
from mapweave.orders import MAX_REASON, Order, OrderEffect, OrderKind
from mapweave_protocol.wire.budget import KIB, MIB, Budget
from mapweave_protocol.wire.model import (
    MAX_ALIGNMENTS,
    ComponentName,
    Count,
    Id,
    JointTransform,
    Label,
    Message,
    Number,
    Sentence,
    Transform,
    WireModel,
    to_transform,
)

MAX_ORDERS = 4096  # of a team
MAX_BOOTS = 64  # of a robot that are forgotten at once
DIGEST_SIZE = 8  # [bytes]
MAX_CERTIFICATE, MAX_SIGNATURE = 2048, 128  # [bytes]; those of mapweave keys take some 480 and 72
_ENDS = {OrderKind.MARK: 1, OrderKind.PIN: 2, OrderKind.FORBID: 2, OrderKind.FORGET: 0}

Kind = Annotated[OrderKind, Field(strict=False)]  # on the wire it is its name


class WireEnd(WireModel):
    """A component, and what in it an order holds on to: so it is found whatever its name becomes.

    Attributes
    ----------
    robot, boot
        Whose run mapped it.
    component
        Its name when it was ordered.
    submap, scan
        As of `mapweave.marks.Anchor`.
    """

    robot: Id
    boot: Id
    component: ComponentName
    submap: Count
    scan: Count | None = None

    @property
    def anchor(self) -> Anchor:
        """What the order holds on to."""
        return Anchor(self.submap, self.scan)


class OrderSignature(WireModel):
    """What proves who gave an order (`mapweave_protocol.link.security.signatures`).

    Attributes
    ----------
    certificate
        Of whoever signed it: X.509, as DER.
    signature
        Over all else that the order says: ECDSA with SHA-256, as DER.
    """

    certificate: Annotated[bytes, Field(min_length=1, max_length=MAX_CERTIFICATE)]
    signature: Annotated[bytes, Field(min_length=1, max_length=MAX_SIGNATURE)]


class OrderMessage(Message):
    """An order of an operator.

    Attributes
    ----------
    id
        By it an order is taken back.
    by
        The operator's name.
    time
        When [s since 1970].
    reason
        Why, in the operator's words.
    takes_back
        The id of an order of the same kind that is in force no longer; then all below is empty.
    ends
        Of a mark what it is on, of a pin or a ban its reference and its other component.
    transform
        Of a pin, and of a ban of one place: from the other's submap to the reference's, as their
        anchors have them. Of a mark: where it is in its anchor's frame [m, m], and 0.
    label
        Of a mark.
    robot, boots
        Whose runs, and which, are to be forgotten.
    signature
        What proves who gave it; missing in a team without keys.
    """

    letter: ClassVar[bytes] = b"o"
    format: ClassVar[str] = "order"
    budget: ClassVar[Budget] = Budget(64 * KIB, 256 * KIB, 4096)

    id: Id
    kind: Kind
    by: Id
    time: Number
    reason: Annotated[Sentence, Field(min_length=1, max_length=MAX_REASON)]
    takes_back: Id | None = None
    ends: tuple[WireEnd, ...] = Field(default=(), max_length=2)
    transform: Transform | None = None
    label: Label | None = None
    robot: Id | None = None
    boots: tuple[Id, ...] = Field(default=(), max_length=MAX_BOOTS)
    signature: OrderSignature | None = None

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.takes_back is not None:
            if self.ends or self.transform or self.label or self.robot or self.boots:
                raise ValueError("takes back another one: expected nothing that it is about")
            return self
        if len(self.ends) != _ENDS[self.kind]:
            raise ValueError(f"{self.kind}: expected {_ENDS[self.kind]} ends")
        if (self.label is not None) != (self.kind is OrderKind.MARK):
            raise ValueError(f"{self.kind}: expected a label of a mark, and of nothing else")
        told = {self.robot is not None, len(self.boots) > 0}
        if told != {self.kind is OrderKind.FORGET}:
            raise ValueError(f"{self.kind}: expected a robot and its runs to be forgotten only")
        self._check_transform()
        return self

    def _check_transform(self) -> None:
        needed = self.kind in (OrderKind.MARK, OrderKind.PIN)
        if self.transform is None and needed:
            raise ValueError(f"{self.kind}: expected a transform")
        if self.transform is not None and self.kind is OrderKind.FORGET:
            raise ValueError(f"{self.kind}: expected no transform")


class OrdersMessage(Message):
    """All orders that somebody holds, those taken back and what took them back among them."""

    letter: ClassVar[bytes] = b"l"
    format: ClassVar[str] = "orders"
    budget: ClassVar[Budget] = Budget(4 * MIB, 8 * MIB, 150_000)

    orders: tuple[OrderMessage, ...] = Field(max_length=MAX_ORDERS)


class WireOrder(WireModel):
    """An order as a joint map tells it; fields as of `mapweave.orders.Order`."""

    id: Id
    kind: Kind
    by: Id
    time: Number
    reason: Sentence
    reference: ComponentName | None = None
    other: ComponentName | None = None
    transform: JointTransform | None = None
    robot: Id | None = None
    boots: tuple[Id, ...] = Field(default=(), max_length=MAX_ALIGNMENTS)
    effect: Annotated[OrderEffect, Field(strict=False)] = OrderEffect.IN_FORCE

    @classmethod
    def pack(cls, order: Order) -> Self:
        """Return `order` for the wire."""
        return cls(
            id=order.id,
            kind=order.kind,
            by=order.by,
            time=float(order.time),
            reason=order.reason,
            reference=order.reference or None,
            other=order.other or None,
            transform=None if order.transform is None else to_transform(order.transform),
            robot=order.robot or None,
            boots=order.boots,
            effect=order.effect,
        )

    def unpack(self) -> Order:
        """Return the order."""
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
            boots=self.boots,
            effect=self.effect,
        )


def new_order_id() -> str:
    """Return a fresh id of an order or a mark."""
    return secrets.token_hex(6)


def in_force(orders: Iterable[OrderMessage]) -> list[OrderMessage]:
    """Return those of `orders` that none of them takes back, the earliest first.

    An order is taken back by one of its own kind only: a key says of what kind it is, and who may
    write to it may not speak of another one.
    """
    known = list(orders)
    taken_back = {(order.kind, order.takes_back) for order in known}
    standing = [o for o in known if o.takes_back is None and (o.kind, o.id) not in taken_back]
    return sorted(standing, key=lambda order: (order.time, order.id))


def taking_back(order: OrderMessage, by: str, time: float, reason: str) -> OrderMessage:
    """Return what takes `order` back."""
    return OrderMessage(
        id=new_order_id(), kind=order.kind, by=by, time=time, reason=reason, takes_back=order.id
    )


def digest_of(ids: Iterable[str]) -> bytes:
    """Return what tells sets of orders apart by the orders' ids; nothing of none."""
    ordered: Sequence[str] = sorted(ids)
    if not ordered:
        return b""
    return hashlib.sha256("/".join(ordered).encode()).digest()[:DIGEST_SIZE]
