"""The orders of operators that somebody holds: each once, none ever dropped or changed.

No clock and no network in here.
"""

from collections.abc import Iterable

from mapweave_protocol.wire.messages import OrderMessage, OrdersMessage
from mapweave_protocol.wire.orders.order_message import MAX_ORDERS, digest_of, in_force


class OrderLedger:
    """Takes orders in; those who hold the same agree on what is in force."""

    def __init__(self, orders: Iterable[OrderMessage] = ()) -> None:
        self._orders: dict[str, OrderMessage] = {}
        self._digest = b""
        for order in orders:
            self.take(order)

    @property
    def digest(self) -> bytes:
        """Tells apart which orders are held; nothing of none."""
        return self._digest

    @property
    def message(self) -> OrdersMessage:
        """All of them, for somebody who lacks some."""
        return OrdersMessage(orders=tuple(self._orders.values()))

    @property
    def in_force(self) -> list[OrderMessage]:
        """Those that were not taken back, the earliest first."""
        return in_force(self._orders.values())

    @property
    def is_full(self) -> bool:
        """Whether no other one is taken."""
        return len(self._orders) >= MAX_ORDERS

    def holds(self, identity: str) -> bool:
        """Tell whether the order of an id is held."""
        return identity in self._orders

    def take(self, order: OrderMessage) -> bool:
        """Take in an order; return whether it is news: it was not held, and there is room."""
        if order.id in self._orders or self.is_full:
            return False
        self._orders[order.id] = order
        self._digest = digest_of(self._orders)
        return True
