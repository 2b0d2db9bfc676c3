"""Operators' orders that a robot keeps for its team: a coordinator that has lost them asks."""

from mapweave_agent.past_runs import StateFolder
from mapweave_protocol.link.inbox import Arrival, coordinators_orders_reader, order_reader
from mapweave_protocol.link.lacking import Lacking
from mapweave_protocol.link.order_ledger import OrderLedger
from mapweave_protocol.wire.messages import JointStatusMessage, OrderMessage, OrdersMessage


class KeptOrders:
    """Takes in what is ordered, and keeps it on disk.

    Parameters
    ----------
    folder
        Where.
    """

    def __init__(self, folder: StateFolder) -> None:
        self._folder = folder
        self._ledger = OrderLedger(folder.orders())
        self._orders = order_reader()
        self._answers = coordinators_orders_reader()
        self._coordinators: dict[str, bytes] = {}
        self._lacking = Lacking()

    @property
    def refused(self) -> int:
        """How many messages were not what they should be."""
        return self._orders.refused + self._answers.refused

    @property
    def digest(self) -> bytes:
        """Tells apart which orders are kept; nothing of none."""
        return self._ledger.digest

    @property
    def message(self) -> OrdersMessage:
        """All of them."""
        return self._ledger.message

    def takes(self, arrival: Arrival) -> bool:
        """Take in what arrived, if it is any order; return whether it is."""
        if self._orders.reads(arrival):
            order = self._orders.read(arrival)
            self._keep(() if order is None else (order,))
        elif self._answers.reads(arrival):
            answer = self._answers.read(arrival)
            self._keep(() if answer is None else answer.orders)
        else:
            return False
        return True

    def coordinator(self, status: JointStatusMessage) -> None:
        """Take in which orders a coordinator has."""
        self._coordinators[status.boot] = status.orders

    def lacks(self, now: float) -> bool:
        """Tell whether a coordinator is to be asked for orders, by what they said; `now` [s]."""
        said, self._coordinators = self._coordinators, {}
        own = self.digest
        due = [
            self._lacking.due(boot, (own, held), now, lacks=held not in (b"", own))
            for boot, held in said.items()
        ]
        return any(due)

    def _keep(self, orders: tuple[OrderMessage, ...]) -> None:
        before = self._ledger.digest
        for order in orders:
            self._ledger.take(order)
        if self._ledger.digest != before:
            self._folder.keep_orders(self._ledger.message)
