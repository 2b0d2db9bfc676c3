"""What operators type: whatever is taken can be ordered, and all else is refused by its text."""

import numpy as np
import pytest

from mapweave.maps import LineMap, RobotMap, Submap, Trajectory
from mapweave.orders import OrderKind
from mapweave_protocol.operator.arguments import scan_or_place, transform
from mapweave_protocol.operator.making import mark_at, order_between
from mapweave_protocol.wire.model import ORDER_REACH

FAR = f"{ORDER_REACH:g}"


def map_of(robot: str) -> RobotMap:
    """Return a map whose scans were taken some kilometres from its origin."""
    poses = np.array([[-9e3, 5e3, 0.7], [-9e3, 5.1e3, -2.0]])
    walls = np.array([[0.0, 0.0, 4.0, 0.0], [0.0, 0.0, 0.0, 4.0]])
    lines = LineMap(walls, np.arange(2), np.full(2, 3), ())
    driven = Trajectory(np.arange(2), np.array([1.0, 2.0]), poses)
    return RobotMap(robot, "x", 1, (Submap(0, 0, np.zeros(3), lines, driven),))


@pytest.mark.parametrize("text", [f"{FAR},{FAR}", f"-{FAR},0", "0,0", "3.5,-1"])
def test_a_mark_at_every_place_that_is_taken_can_be_ordered(text: str) -> None:
    place = scan_or_place(text)
    assert not isinstance(place, int)
    order = mark_at(map_of("a"), "a/0", place, "victim", "anna", 5.0)
    assert order.label == "victim"


@pytest.mark.parametrize("text", [f"{FAR},-{FAR},0", "1,2,400", "0,0,-999999999", "0,0,-90"])
def test_a_pin_at_every_transform_that_is_taken_can_be_ordered(text: str) -> None:
    meant = transform(text)
    maps = {f"{robot}/0": map_of(robot) for robot in "ab"}
    order = order_between(OrderKind.PIN, maps, meant, by="anna", reason="so", time=5.0)
    turned = np.exp(1j * np.radians(float(text.split(",")[2])))
    assert np.exp(1j * meant[2]) == pytest.approx(turned, abs=1e-6)
    assert order.kind is OrderKind.PIN


@pytest.mark.parametrize("text", ["50001,0", "0,-999999999", "999999999,999999999"])
def test_what_is_farther_than_any_map_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="expected places at most 50000 m away"):
        scan_or_place(text)
    with pytest.raises(ValueError, match="expected places at most 50000 m away"):
        transform(f"{text},0")
