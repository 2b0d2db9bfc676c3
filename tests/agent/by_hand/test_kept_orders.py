"""A robot keeps what operators order, over its own restarts, and asks for what it missed."""

from pathlib import Path

import pytest

from mapweave.orders import OrderKind
from mapweave_agent.by_hand.kept_orders import KeptOrders
from mapweave_agent.past_runs import ORDERS_FILE, StateFolder
from mapweave_protocol.link.inbox import Arrival
from mapweave_protocol.link.lacking import GRACE
from mapweave_protocol.wire.codec import encode
from mapweave_protocol.wire.keys import JOINT_QUERY, ORDER
from mapweave_protocol.wire.messages import JointStatusMessage, OrderMessage, OrdersMessage


def order(identity: str) -> OrderMessage:
    return OrderMessage(
        id=identity,
        kind=OrderKind.FORGET,
        by="anna",
        time=5.0,
        reason="so",
        robot="a",
        boots=("x",),
    )


def heard(one: OrderMessage) -> Arrival:
    return Arrival(ORDER.build(team="t", name="anna", order="forget"), encode(one))


def status(digest: bytes) -> JointStatusMessage:
    return JointStatusMessage(
        boot="c", stamp=1.0, series="s", version=1, pending=False, orders=digest
    )


def test_orders_are_kept_over_a_restart(tmp_path: Path) -> None:
    kept = KeptOrders(StateFolder(tmp_path))
    assert kept.takes(heard(order("o1")))
    assert kept.takes(heard(order("o2")))
    again = KeptOrders(StateFolder(tmp_path))
    assert [one.id for one in again.message.orders] == ["o1", "o2"]
    assert again.digest == kept.digest != b""


def test_what_a_coordinator_answers_is_kept_as_well_and_what_is_no_order_is_counted(
    tmp_path: Path,
) -> None:
    kept = KeptOrders(StateFolder(tmp_path))
    answer = OrdersMessage(orders=(order("o1"), order("o2")))
    assert kept.takes(Arrival(JOINT_QUERY.build(team="t"), encode(answer)))
    assert len(kept.message.orders) == 2
    assert kept.takes(Arrival(heard(order("o3")).key, b"nonsense"))
    assert kept.refused == 1
    assert not kept.takes(Arrival("mapweave/v2/t/agent/b/map", b""))


def test_a_coordinator_that_holds_others_is_asked_after_a_while_and_rarely(tmp_path: Path) -> None:
    kept = KeptOrders(StateFolder(tmp_path))
    kept.takes(heard(order("o1")))
    for now, digest, expected in (
        (0.0, b"other", False),
        (GRACE, b"other", True),
        (GRACE + 1.0, b"other", False),
        (100.0, b"", False),  # it holds none: it is for it to ask
        (200.0, kept.digest, False),
    ):
        kept.coordinator(status(digest))
        assert kept.lacks(now) == expected


def test_a_file_of_orders_that_is_damaged_is_told_and_passed_over(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    (tmp_path / ORDERS_FILE).write_bytes(b"nonsense")
    assert KeptOrders(StateFolder(tmp_path)).digest == b""
    assert "orders: passed over" in caplog.text
