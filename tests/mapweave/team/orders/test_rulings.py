"""What an operator orders goes before what was found; later orders go before earlier ones."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import ArrayLike

from mapweave.geometry import se2
from mapweave.maps import Alignment, JointMap, LineMap, RobotMap, Submap, Trajectory
from mapweave.orders import Order, OrderEffect, OrderKind
from mapweave.reasons import Reason, ReasonKind, StatusKind
from mapweave.team.joint_builder import JointMapBuilder

PLACES = {"a": (0.0, 0.0, 0.0), "b": (2.0, 1.0, 0.5), "c": (1.0, 3.0, -1.0), "d": (3.0, 2.0, 2.0)}
WRONG = (40.0, 7.0, 1.0)  # where nothing contradicts it

# A room that has no second way to lie on itself; each robot saw all of it.
ROOM = np.array([[0, 0], [9, 0], [9, 4], [5, 4], [5, 7], [0, 7]], dtype=float)


def room_map(robot: str) -> RobotMap:
    """Return the room, seen from `robot`'s place in it."""
    corners = se2.transform_points(se2.inverse(PLACES[robot]), ROOM)
    walls = np.hstack([corners, np.roll(corners, -1, axis=0)])
    count = len(walls)
    inside = se2.transform_points(se2.inverse(PLACES[robot]), ROOM * 0.96 + 0.1)
    lines = LineMap(walls, np.zeros(count, dtype=int), np.full(count, 20), (inside,))
    path = Trajectory(np.array([0]), np.array([0.0]), np.zeros((1, 3)))
    return RobotMap(robot, "boot", 1, (Submap(0, 0, np.zeros(3), lines, path),))


def found(pair: str, *, sure: float = 0.9, off: Sequence[float] | None = None) -> Alignment:
    """Return an accepted alignment of a pair such as ``ab``, right unless moved by `off`."""
    transform = se2.between(PLACES[pair[0]], PLACES[pair[1]])
    if off is not None:
        transform = se2.compose(transform, off)
    cause = Reason.words("40 m of wall in common")
    return Alignment(f"{pair[0]}/0", f"{pair[1]}/0", transform, "accepted", sure, cause)


def order(
    kind: OrderKind, pair: str, transform: ArrayLike | None = None, *, time: float = 1.0
) -> Order:
    """Return an order of anna's about a pair such as ``ab``."""
    given = None if transform is None else np.array(transform)
    return Order(
        f"{kind}-{pair}-{time:g}",
        kind,
        "anna",
        time,
        "so it is",
        reference=f"{pair[0]}/0",
        other=f"{pair[1]}/0",
        transform=given,
    )


def true_pin(pair: str, *, time: float = 1.0) -> Order:
    transform = se2.between(PLACES[pair[0]], PLACES[pair[1]])
    return order(OrderKind.PIN, pair, transform, time=time)


def build(robots: str, alignments: Sequence[Alignment], *orders: Order) -> JointMap:
    maps = [room_map(robot) for robot in robots]
    return JointMapBuilder().build(maps, alignments, 1, orders)


def groups(joint: JointMap) -> list[str]:
    """Return who is together, such as ``["ab", "c"]``."""
    return sorted("".join(sorted(n[0] for n in c.robots)) for c in joint.components)


def effects(joint: JointMap) -> dict[str, OrderEffect]:
    return {order.id: order.effect for order in joint.orders}


def test_a_pin_joins_what_nothing_was_found_about() -> None:
    joint = build("ab", [], true_pin("ab"))
    [component] = joint.components
    expected = se2.between(PLACES["a"], PLACES["b"])
    np.testing.assert_allclose(component.robots["b/0"], expected, atol=0.01)
    [alignment] = joint.alignments
    assert alignment.reason == "pinned by anna: so it is"
    assert alignment.status is not None and alignment.status.kind is StatusKind.RELIED_ON
    assert component.confidence > 0.99


def test_what_was_found_near_a_pin_is_relied_on_as_it_was_found() -> None:
    doubtful = replace(found("ab", sure=0.4), decision="ambiguous")
    rough = se2.compose(doubtful.transform, [0.3, -0.2, 0.05])
    joint = build("ab", [doubtful], order(OrderKind.PIN, "ab", rough))
    [alignment] = joint.alignments
    np.testing.assert_allclose(alignment.transform, doubtful.transform)
    assert alignment.decision == "accepted"
    assert alignment.reason == "pinned by anna: so it is; 40 m of wall in common"


def test_a_pin_is_understood_whichever_of_the_two_it_names_first() -> None:
    joint = build("ab", [replace(found("ab"), decision="refused")], true_pin("ba"))
    assert groups(joint) == ["ab"]
    [component] = joint.components
    expected = se2.between(PLACES["a"], PLACES["b"])
    np.testing.assert_allclose(component.robots["b/0"], expected, atol=0.01)


def test_a_pin_outweighs_any_number_of_alignments_that_say_otherwise() -> None:
    # Without the pin all agree that b is elsewhere.
    there = se2.compose(PLACES["b"], WRONG)
    elsewhere = [
        replace(found(f"b{near}", sure=0.8), transform=se2.between(there, PLACES[near]))
        for near in "cd"
    ]
    wrong = found("ab", sure=0.99, off=WRONG)
    evidence = [wrong, found("ac"), found("ad"), found("cd"), *elsewhere]
    before = build("abcd", evidence)
    [component] = before.components
    np.testing.assert_allclose(component.robots["b/0"], there, atol=0.1)
    after = build("abcd", evidence, true_pin("ab"))
    [component] = after.components
    expected = se2.between(PLACES["a"], PLACES["b"])
    np.testing.assert_allclose(component.robots["b/0"], expected, atol=0.1)
    objected = {a.reference + a.other for a in after.alignments if a.decision == "ambiguous"}
    assert objected == {"b/0c/0", "b/0d/0"}


def test_maps_that_contradict_a_pin_do_not_undo_it() -> None:
    half_turn = se2.compose(se2.between(PLACES["a"], PLACES["b"]), [0.0, 0.0, np.pi])
    contradicted = replace(found("ab"), transform=half_turn)
    assert groups(build("ab", [contradicted])) == ["a", "b"]
    assert groups(build("ab", [contradicted], order(OrderKind.PIN, "ab", half_turn))) == ["ab"]


def test_what_is_forbidden_is_not_joined_whatever_was_found() -> None:
    joint = build("ab", [found("ab", sure=0.999)], order(OrderKind.FORBID, "ba"))
    assert groups(joint) == ["a", "b"]
    [alignment] = joint.alignments
    assert alignment.decision == "refused"
    assert alignment.cause.kind is ReasonKind.FORBIDDEN
    assert alignment.reason == "set aside: forbidden by anna: so it is; 40 m of wall in common"


def test_what_is_forbidden_is_not_joined_by_way_of_others_and_the_weakest_gives_way() -> None:
    chain = [found("ac", sure=0.95), found("cb", sure=0.7)]
    assert groups(build("abc", chain)) == ["abc"]
    joint = build("abc", chain, order(OrderKind.FORBID, "ab"))
    assert groups(joint) == ["ac", "b"]
    [weaker] = [a for a in joint.alignments if a.decision == "ambiguous"]
    assert (weaker.reference, weaker.other) == ("c/0", "b/0")
    said = "set aside: would join a/0 and b/0, forbidden by anna: so it is; 40 m of wall in common"
    assert weaker.reason == said


def test_every_way_between_what_is_forbidden_is_cut() -> None:
    ways = [found("ac"), found("cb"), found("ad"), found("db"), found("cd")]
    joint = build("abcd", ways, order(OrderKind.FORBID, "ab"))
    together = next(group for group in groups(joint) if "a" in group)
    assert "b" not in together


def test_a_ban_of_one_place_lets_another_one_stand() -> None:
    elsewhere = found("ab", off=WRONG)
    here = order(OrderKind.FORBID, "ab", se2.between(PLACES["a"], PLACES["b"]))
    assert groups(build("ab", [elsewhere], here)) == ["ab"]
    assert groups(build("ab", [found("ab", off=(0.4, 0.3, 0.05))], here)) == ["a", "b"]


@pytest.mark.parametrize("later", [OrderKind.PIN, OrderKind.FORBID])
def test_the_later_of_two_orders_that_contradict_each_other_stands(later: OrderKind) -> None:
    times = {OrderKind.PIN: 1.0, OrderKind.FORBID: 1.0} | {later: 2.0}
    pin = true_pin("ab", time=times[OrderKind.PIN])
    ban = order(OrderKind.FORBID, "ab", time=times[OrderKind.FORBID])
    joint = build("ab", [], pin, ban)
    assert groups(joint) == (["ab"] if later is OrderKind.PIN else ["a", "b"])
    outranked = ban if later is OrderKind.PIN else pin
    assert effects(joint)[outranked.id] is OrderEffect.OUTRANKED


def test_pins_that_do_not_agree_around_a_cycle_leave_the_later_ones() -> None:
    apart = order(OrderKind.PIN, "ac", WRONG, time=1.0)
    joint = build("abc", [], true_pin("ab", time=2.0), true_pin("bc", time=3.0), apart)
    assert effects(joint)[apart.id] is OrderEffect.OUTRANKED
    [component] = joint.components
    expected = se2.between(PLACES["a"], PLACES["c"])
    np.testing.assert_allclose(component.robots["c/0"], expected, atol=0.01)


def test_an_order_about_what_is_not_there_waits() -> None:
    joint = build("ab", [], true_pin("ac"), order(OrderKind.FORBID, "cd"))
    assert set(effects(joint).values()) == {OrderEffect.WAITS}
    assert groups(joint) == ["a", "b"]


def test_without_orders_nothing_is_different() -> None:
    alignments = [found("ab"), found("bc", off=WRONG), found("ac")]
    with_none = build("abc", alignments)
    with_waiting = build("abc", alignments, order(OrderKind.FORBID, "xy"))
    assert [a.reason for a in with_none.alignments] == [a.reason for a in with_waiting.alignments]
    for one, other in zip(with_none.components, with_waiting.components, strict=True):
        np.testing.assert_array_equal(one.map.segments, other.map.segments)
