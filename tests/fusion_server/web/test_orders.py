"""What is ordered by the page reaches the coordinator as an order like any other, or is refused."""

import json
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from mapweave.evidence import Evidence
from mapweave.marks import PlacedMark
from mapweave.orders import Order, OrderKind
from tests.fusion_server.web.conftest import TOKEN, Answer, MakeMap, Page, make_joint

BY = {"by": "anna", "reason": "same door"}
PIN = {"kind": "pin", "reference": "a/0", "other": "b/0", **BY}
BAN = Order("0b1", OrderKind.FORBID, "ben", 5.0, "two floors", "a/0", "b/0")


@pytest.fixture
def known(page: Page, make_map: MakeMap) -> Page:
    """Return a page of two robots between which something was found, and a ban."""
    maps = make_map("a"), make_map("b")
    joint = make_joint(1, maps[0].lines(0), a=0.0, b=3.0)
    [found] = joint.alignments
    evidence = Evidence(common=9.0)
    page.publish(
        replace(joint, alignments=(replace(found, evidence=evidence),), orders=(BAN,)), maps
    )
    return page


def order(page: Page, wish: Mapping[str, Any] | bytes, **headers: str) -> Answer:
    """Return what the server says to an order, given as the page gives it."""
    usual = {"Origin": page.address.url().rstrip("/"), "X-Mapweave-Token": TOKEN}
    usual |= {"Content-Type": "application/json"}
    body = wish if isinstance(wish, bytes) else json.dumps(wish).encode()
    named = {name.replace("_", "-"): value for name, value in headers.items()}
    return page.ask("/api/orders", "POST", usual | named, body)


def test_a_pin_is_of_what_was_found_and_reaches_the_coordinator(known: Page) -> None:
    answer = order(known, PIN)
    assert answer.status == 202
    [given] = known.feed.orders()
    assert given.id == answer.json["id"]
    assert (given.kind, given.by, given.reason) == (OrderKind.PIN, "anna", "same door")
    assert [end.component for end in given.ends] == ["a/0", "b/0"]
    assert given.transform is not None
    np.testing.assert_allclose(given.transform, [3.0, 0.0, 0.0])
    assert known.feed.orders() == []


def test_a_pin_of_a_given_transform_and_a_ban_of_any(known: Page) -> None:
    assert order(known, {**PIN, "transform": [1.0, 2.0, 0.5]}).status == 202
    assert order(known, {**PIN, "kind": "forbid"}).status == 202
    pin, ban = known.feed.orders()
    assert pin.transform is not None
    np.testing.assert_allclose(pin.transform, [1.0, 2.0, 0.5])
    assert (ban.kind, ban.transform) == (OrderKind.FORBID, None)


def test_an_order_is_taken_back_by_one_that_names_it(known: Page) -> None:
    assert order(known, {"takes_back": "0b1", **BY}).status == 202
    [given] = known.feed.orders()
    assert (given.kind, given.takes_back) == (OrderKind.FORBID, "0b1")
    assert order(known, {"takes_back": "0b2", **BY}).status == 404


@pytest.mark.parametrize(
    ("change", "status", "problem"),
    [
        ({"kind": "forget"}, 400, "kind: "),
        ({"other": "c/0"}, 404, "no map of component c/0"),
        ({"other": "b"}, 400, "other: "),
        ({"other": "a/0"}, 400, "a/0: expected two components"),
        ({"by": "Anna"}, 400, "by: "),
        ({"by": "<b>"}, 400, "by: "),
        ({"reason": ""}, 400, "reason: "),
        ({"reason": "x" * 201}, 400, "reason: "),
        ({"reason": "a\u001b[2J"}, 400, "reason: "),
        ({"transform": [1.0, 2.0]}, 400, "transform"),
        ({"transform": [1e9, 0.0, 0.0]}, 400, "transform"),
        ({"colour": "red"}, 400, "colour: "),
    ],
)
def test_what_is_no_order_is_refused_in_one_line(
    known: Page, change: dict[str, Any], status: int, problem: str
) -> None:
    answer = order(known, {**PIN, **change})
    assert answer.status == status
    assert answer.body.decode().startswith(problem)
    assert len(answer.body.decode().splitlines()) == 1
    assert known.feed.orders() == []


def test_where_nothing_was_found_there_is_nothing_to_confirm(page: Page, make_map: MakeMap) -> None:
    maps = make_map("a"), make_map("b")
    page.publish(make_joint(1, maps[0].lines(0), a=0.0, b=3.0), maps)  # without any evidence
    answer = order(page, PIN)
    assert answer.status == 409
    assert answer.body.startswith(b"nothing was found between a/0 and b/0")


def test_an_order_needs_the_token_and_to_come_from_this_page(known: Page) -> None:
    for header in (
        {"X_Mapweave_Token": "guessed"},
        {"X_Mapweave_Token": ""},
        {"Origin": "https://evil.example"},
        {"Host": "evil.example"},
        {"Sec_Fetch_Site": "cross-site"},
    ):
        assert order(known, PIN, **header).status == 403
    # What a form can send without asking, whatever token it has.
    assert order(known, PIN, Content_Type="text/plain").status == 415
    assert order(known, b"x" * 5000).status == 413
    assert order(known, b"nonsense").status == 400
    assert known.feed.orders() == []


def test_of_too_many_orders_the_last_are_refused_and_none_is_lost(known: Page) -> None:
    answers = [order(known, {**PIN, "kind": "forbid"}).status for _ in range(66)]
    assert answers == [202] * 64 + [503] * 2
    assert len(known.feed.orders()) == 64
    assert order(known, PIN).status == 202


def test_marks_are_told_with_the_frame_that_they_are_in(page: Page, make_map: MakeMap) -> None:
    assert page.ask("/api/marks").json == {"version": 0, "marks": []}
    joint = make_joint(1, make_map("a").lines(0), a=0.0, b=3.0)
    [component] = joint.components
    mark = PlacedMark("m1", "victim", "anna", 5.0, "b/0", np.array([1.5, -2.0]))
    page.publish(replace(joint, components=(replace(component, marks=(mark,)),)))
    assert page.ask("/api/marks").json == {
        "version": 1,
        "marks": [
            {
                "id": "m1", "label": "victim", "by": "anna", "time": 5.0, "component": "b/0",
                "position": [1.5, -2.0], "frame": "a/0",
            }
        ],
    }  # fmt: skip
