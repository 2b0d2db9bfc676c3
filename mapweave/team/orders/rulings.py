"""Operators' orders over evidence: what is pinned is right, what is forbidden is not.

Later orders outrank earlier ones that they contradict.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.maps import Alignment
from mapweave.orders import Order, OrderEffect, OrderKind
from mapweave.reasons import Reason, ReasonKind, Status, StatusKind
from mapweave.team.cycles import Edge, misfit, poses_along
from mapweave.team.orders.bans import Ban, is_same, joining

CONFIRMED_PLACE = 0.5  # [m] and
CONFIRMED_TURN = 0.087  # [rad], 5°: within these what was found is what was pinned, only finer


@dataclass(frozen=True, slots=True, eq=False)
class Rulings:
    """What orders come to.

    Attributes
    ----------
    orders
        All of them, each with its effect.
    pins, forbidden
        Those that pin and those that forbid, in force.
    bans
        The latter for the graph of alignments.
    middles
        (3,) frame of each component in which transforms are compared [m, m, rad].
    """

    orders: tuple[Order, ...]
    pins: tuple[Order, ...]
    forbidden: tuple[Order, ...]
    bans: tuple[Ban, ...]
    middles: Mapping[str, FloatArray]

    @classmethod
    def of(
        cls, orders: Sequence[Order], names: Sequence[str], middles: Mapping[str, FloatArray]
    ) -> "Rulings":
        """Return what `orders` come to between the components `names`; the latest go first."""
        court = _Court(names, middles)
        latest = sorted(orders, key=lambda order: (-order.time, order.id))
        effects = {order.id: court.judge(order) for order in latest}
        judged = tuple(replace(order, effect=effects[order.id]) for order in orders)
        in_force = [order for order in judged if order.effect is OrderEffect.IN_FORCE]
        pins = tuple(order for order in in_force if order.kind is OrderKind.PIN)
        forbidden = tuple(order for order in in_force if order.kind is OrderKind.FORBID)
        return cls(judged, pins, forbidden, tuple(court.bans), middles)

    def applied(self, alignments: Sequence[Alignment]) -> tuple[Alignment, ...]:
        """Return `alignments` as ordered, with one for each pin of which nothing was found."""
        ruled = [self._ruled(alignment) for alignment in alignments]
        unfound = [p for p in self.pins if not any(_is_about(p, a) for a in alignments)]
        return (*ruled, *(_pinned(pin) for pin in unfound))

    def _ruled(self, alignment: Alignment) -> Alignment:
        pin = next((p for p in self.pins if _is_about(p, alignment)), None)
        if pin is not None:
            return _confirmed(alignment, pin)
        forbids = (o for o in self.forbidden if _is_about(o, alignment))
        order = next((o for o in forbids if self._means(o, alignment)), None)
        return alignment if order is None else _refused(alignment, order)

    def _means(self, order: Order, alignment: Alignment) -> bool:
        """Tell whether an order about the same components is about this transform of theirs."""
        if order.transform is None:
            return True
        ours, theirs = (self.middles[name] for name in (alignment.reference, alignment.other))
        meant, found = (
            at_middles(transform, ours, theirs)
            for transform in (_as_seen_from(alignment, order), alignment.transform)
        )
        return is_same(meant, found)


class _Court:
    """Takes orders from the latest on, as far as they agree with those before."""

    def __init__(self, names: Sequence[str], middles: Mapping[str, FloatArray]) -> None:
        self._number = {name: number for number, name in enumerate(names)}
        self._middles = middles
        self.bans: list[Ban] = []
        self._edges: list[Edge] = []

    def judge(self, order: Order) -> OrderEffect:
        """Take `order`, if it can be, and return its effect."""
        if order.kind not in (OrderKind.PIN, OrderKind.FORBID):
            return order.effect
        ends = set(_ends(order))
        if len(ends) < 2 or not ends <= self._number.keys():
            return OrderEffect.WAITS
        agrees = self._take_pin(order) if order.kind is OrderKind.PIN else self._take_ban(order)
        return OrderEffect.IN_FORCE if agrees else OrderEffect.OUTRANKED

    def _take_pin(self, order: Order) -> bool:
        ours, theirs = (self._middles[name] for name in _ends(order))
        transform = at_middles(_transform(order), ours, theirs)
        edge = Edge(*self._nodes(order), transform, 1.0, pinned=True)
        edges = [*self._edges, edge]
        poses, paths = poses_along(edge.first, *self._graph(self._edges))
        if paths[edge.second] >= 0 and not is_same(transform, poses[edge.second]):
            return False
        if any(joining(ban, *self._graph(edges)) for ban in self.bans):
            return False
        self._edges.append(edge)
        return True

    def _take_ban(self, order: Order) -> bool:
        ban = Ban(*self._nodes(order), self._between_middles(order), _ends(order), order.words)
        if joining(ban, *self._graph(self._edges)):
            return False
        self.bans.append(ban)
        return True

    def _nodes(self, order: Order) -> tuple[int, int]:
        return self._number[order.reference], self._number[order.other]

    def _graph(self, edges: Sequence[Edge]) -> tuple[int, Sequence[Edge], range]:
        return len(self._number), edges, range(len(edges))

    def _between_middles(self, order: Order) -> FloatArray | None:
        if order.transform is None:
            return None
        return at_middles(order.transform, *(self._middles[name] for name in _ends(order)))


def at_middles(transform: FloatArray, ours: FloatArray, theirs: FloatArray) -> FloatArray:
    """Return (3,) a transform between components as one between frames (3,) at their middles."""
    return se2.between(ours, se2.compose(transform, theirs))


def _ends(order: Order) -> tuple[str, str]:
    return order.reference, order.other


def _is_about(order: Order, alignment: Alignment) -> bool:
    return {alignment.reference, alignment.other} == set(_ends(order))


def _confirmed(found: Alignment, pin: Order) -> Alignment:
    """Return what was found as it was pinned; anew, where it is something else that was."""
    transform = _as_seen_from(found, pin)
    off = misfit(transform, np.zeros(3), found.transform)
    if np.hypot(off[0], off[1]) > CONFIRMED_PLACE or abs(off[2]) > CONFIRMED_TURN:
        return _pinned(pin)
    cause = Reason(ReasonKind.PINNED, found=found.cause, text=pin.words)
    return replace(found, decision="accepted", confidence=1.0, cause=cause, status=None)


def _refused(found: Alignment, order: Order) -> Alignment:
    """Return what was found as it was forbidden."""
    cause = Reason(ReasonKind.FORBIDDEN, found=found.cause, text=order.words)
    set_aside = Status(StatusKind.SET_ASIDE) if found.decision == "accepted" else None
    return replace(found, decision="refused", cause=cause, status=set_aside)


def _pinned(pin: Order) -> Alignment:
    cause = Reason(ReasonKind.PINNED, text=pin.words)
    return Alignment(pin.reference, pin.other, _transform(pin), "accepted", 1.0, cause)


def _as_seen_from(found: Alignment, order: Order) -> FloatArray:
    """Return (3,) what an order is about, from the other of `found` to its reference."""
    transform = _transform(order)
    return transform if found.reference == order.reference else se2.inverse(transform)


def _transform(order: Order) -> FloatArray:
    if order.transform is None:
        raise ValueError(f"order {order.id}: expected a transform")
    return order.transform
