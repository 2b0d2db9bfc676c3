"""Orders and marks travel as they are, within bounds; who has the same orders agrees on them."""

import random
from typing import Any

import msgpack
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from mapweave.marks import Anchor, Mark
from mapweave.orders import MAX_REASON, OrderKind
from mapweave_protocol.errors import MessageError
from mapweave_protocol.link.inbox import (
    Arrival,
    check_origin,
    marks_reader,
    order_reader,
)
from mapweave_protocol.link.order_ledger import OrderLedger
from mapweave_protocol.wire.codec import decode, encode
from mapweave_protocol.wire.keys import MARK, ORDER
from mapweave_protocol.wire.messages import MarksMessage, OrderMessage, OrdersMessage
from mapweave_protocol.wire.model import Message
from mapweave_protocol.wire.orders.order_message import (
    MAX_ORDERS,
    WireEnd,
    digest_of,
    in_force,
    taking_back,
)

A = WireEnd(robot="a", boot="x", component="a/0", submap=0, scan=7)
B = WireEnd(robot="b", boot="y", component="b/3", submap=4)
COMMON: dict[str, Any] = {"id": "o1", "by": "anna", "time": 5.0, "reason": "so it is"}


def mark(identity: str = "o1", label: str = "victim", time: float = 5.0) -> OrderMessage:
    about = {**COMMON, "id": identity, "time": time}
    return OrderMessage(
        **about, kind=OrderKind.MARK, ends=(A,), transform=(1.0, 2.0, 0.0), label=label
    )


VALID: dict[OrderKind, dict[str, Any]] = {
    OrderKind.MARK: {"ends": (A,), "transform": (1.0, 2.0, 0.0), "label": "victim"},
    OrderKind.PIN: {"ends": (A, B), "transform": (1.0, 2.0, 0.5)},
    OrderKind.FORBID: {"ends": (A, B)},
    OrderKind.FORGET: {"robot": "a", "boots": ("x", "y")},
}


@pytest.mark.parametrize("kind", VALID)
def test_an_order_arrives_as_it_was_given(kind: OrderKind) -> None:
    order = OrderMessage(**COMMON, kind=kind, **VALID[kind])
    assert decode(OrderMessage, encode(order)) == order
    back = taking_back(order, "ben", 6.0, "no longer")
    assert decode(OrderMessage, encode(back)) == back
    held = OrdersMessage(orders=(order, back))
    assert decode(OrdersMessage, encode(held)) == held


@pytest.mark.parametrize(
    ("kind", "change"),
    [
        (OrderKind.MARK, {"ends": ()}),
        (OrderKind.MARK, {"ends": (A, B)}),
        (OrderKind.MARK, {"label": None}),
        (OrderKind.MARK, {"label": "a\u001b[2J"}),
        (OrderKind.MARK, {"label": "x" * 65}),
        (OrderKind.MARK, {"transform": None}),
        (OrderKind.MARK, {"transform": (np.nan, 0.0, 0.0)}),
        (OrderKind.PIN, {"transform": None}),
        (OrderKind.PIN, {"transform": (1e6, 0.0, 0.0)}),
        (OrderKind.PIN, {"ends": (A,)}),
        (OrderKind.PIN, {"label": "victim"}),
        (OrderKind.FORBID, {"robot": "a"}),
        (OrderKind.FORGET, {"boots": ()}),
        (OrderKind.FORGET, {"robot": None}),
        (OrderKind.FORGET, {"boots": ("x",) * 65}),
        (OrderKind.FORGET, {"transform": (0.0, 0.0, 0.0)}),
        (OrderKind.FORGET, {"reason": ""}),
        (OrderKind.FORGET, {"reason": "x" * (MAX_REASON + 1)}),
        (OrderKind.FORGET, {"by": "Anna"}),
        (OrderKind.FORGET, {"takes_back": "o0"}),
    ],
)
def test_what_is_no_order_is_refused(kind: OrderKind, change: dict[str, Any]) -> None:
    with pytest.raises(ValidationError):
        OrderMessage(**{**COMMON, "kind": kind, **VALID[kind], **change})


def test_an_order_under_anothers_name_or_of_another_kind_than_its_key_is_refused() -> None:
    order, reader = mark(), order_reader()
    key = ORDER.build(team="t", name="anna", order="mark")
    assert reader.read(Arrival(key, encode(order))) == order
    for name, kind in (("ben", "mark"), ("anna", "forget")):
        with pytest.raises(MessageError, match="under the key of"):
            check_origin(order, {"team": "t", "name": name, "order": kind})
    assert (
        reader.read(Arrival(ORDER.build(team="t", name="ben", order="mark"), encode(order))) is None
    )
    assert reader.refused == 1


def test_the_marks_of_a_robot_arrive_within_a_tenth_of_a_millimetre() -> None:
    marks = [
        Mark("m1", "victim", "r1", 5.0, Anchor(3, 17), np.array([1.25, -0.3])),
        Mark("m2", "door", "r1", 6.0, Anchor(4, None), np.array([0.0, 2.0])),
    ]
    message = MarksMessage.pack("r1", "x", 2, marks)
    arrived = decode(MarksMessage, encode(message)).unpack()
    for one, other in zip(marks, arrived, strict=True):
        assert (one.id, one.label, one.by, one.anchor) == (
            other.id, other.label, other.by, other.anchor
        )  # fmt: skip
        np.testing.assert_allclose(one.position, other.position, atol=1e-4)
    reader = marks_reader()
    assert reader.read(Arrival(MARK.build(team="t", robot="r1"), encode(message))) == message
    assert reader.read(Arrival(MARK.build(team="t", robot="r2"), encode(message))) is None


def test_a_mark_twice_or_too_many_of_them_are_refused() -> None:
    one = Mark("m1", "victim", "r1", 5.0, Anchor(3, 17), np.zeros(2))
    with pytest.raises(ValidationError, match="each once"):
        MarksMessage.pack("r1", "x", 2, [one, one])
    many = [Mark(f"m{k}", "v", "r1", 5.0, Anchor(3, 17), np.zeros(2)) for k in range(1025)]
    with pytest.raises(ValidationError):
        MarksMessage.pack("r1", "x", 2, many)


@given(st.binary(max_size=200), st.sampled_from([OrderMessage, OrdersMessage, MarksMessage]))
def test_whatever_the_bytes_an_order_is_valid_or_refused(noise: bytes, kind: type[Message]) -> None:
    for payload in (
        noise,
        msgpack.packb({"format": kind.format, "deflated": False, "body": noise}),
    ):
        with pytest.raises(MessageError):
            decode(kind, payload)


def test_in_whatever_order_they_come_the_same_orders_are_in_force() -> None:
    orders = [mark(f"o{k}", time=float(k)) for k in range(6)]
    back = [taking_back(orders[k], "ben", 10.0 + k, "no") for k in (1, 4)]
    everything = [*orders, *back]
    expected = ["o0", "o2", "o3", "o5"]
    for seed in range(20):
        random.Random(seed).shuffle(everything)
        ledger = OrderLedger()
        for order in (*everything, *everything):  # each comes twice
            ledger.take(order)
        assert [order.id for order in ledger.in_force] == expected
        assert ledger.digest == digest_of(order.id for order in everything)


def test_an_order_is_taken_back_by_one_of_its_own_kind_only() -> None:
    order = mark()
    other = OrderMessage(**{**COMMON, "id": "o2"}, kind=OrderKind.PIN, takes_back="o1")
    assert in_force([order, other]) == [order]
    assert in_force([order, taking_back(order, "ben", 6.0, "no")]) == []


def test_one_who_holds_nothing_has_no_digest_and_each_set_has_its_own() -> None:
    assert OrderLedger().digest == b""
    one, two = OrderLedger([mark("o1")]), OrderLedger([mark("o1"), mark("o2")])
    assert len({one.digest, two.digest, b""}) == 3
    assert OrderLedger([mark("o2"), mark("o1")]).digest == two.digest


def test_a_ledger_that_is_full_takes_no_more_and_forgets_none(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert MAX_ORDERS == 4096
    monkeypatch.setattr("mapweave_protocol.link.order_ledger.MAX_ORDERS", 2)
    ledger = OrderLedger([mark("o1"), mark("o2")])
    assert ledger.is_full
    assert not ledger.take(mark("o3"))
    assert [order.id for order in ledger.in_force] == ["o1", "o2"]
