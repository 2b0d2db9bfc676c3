"""What a robot marks is held by what it has mapped, and published until it is known."""

import numpy as np
import pytest

from mapweave.anchors import find
from mapweave.errors import ArgumentError
from mapweave.geometry import se2
from mapweave.maps import LineMap, Submap, Trajectory
from mapweave.marks import Anchor
from mapweave_agent.by_hand.own_marks import OwnMarks, checked

SUBMAPS = tuple(
    Submap(
        k,
        0,
        np.array([2.0 * k, 0.0, 0.5 * k]),
        LineMap.empty(),
        Trajectory(
            3 * k + np.arange(3),
            np.arange(3.0),
            np.column_stack([0.5 * np.arange(3), np.zeros(3), 0.1 * np.arange(3)]),
        ),
    )
    for k in range(2)
)


def place_of(marks: OwnMarks) -> tuple[Anchor, list[float]]:
    """Return what holds the only mark, and where it is in the component."""
    [mark] = marks.message().unpack()
    held = find(SUBMAPS, mark.anchor)
    assert held is not None
    pose = se2.compose(held[0].pose, held[1])
    return mark.anchor, se2.transform_points(pose, mark.position).tolist()


def test_a_place_on_the_map_is_held_by_the_scan_next_to_it() -> None:
    marks = OwnMarks("a", "x")
    marks.add(SUBMAPS, "victim", np.array([0.6, 0.2]), "map", 5.0)
    anchor, place = place_of(marks)
    assert anchor == Anchor(0, 1)
    np.testing.assert_allclose(place, [0.6, 0.2], atol=1e-4)


def test_a_place_seen_by_the_sensor_is_held_by_the_last_scan() -> None:
    marks = OwnMarks("a", "x")
    marks.add(SUBMAPS, "victim", np.array([1.0, 0.5]), "sensor", 5.0)
    anchor, place = place_of(marks)
    assert anchor == Anchor(1, 5)
    pose = se2.compose(SUBMAPS[1].pose, SUBMAPS[1].trajectory.pose[2])
    np.testing.assert_allclose(place, se2.transform_points(pose, [1.0, 0.5]), atol=1e-4)


def test_marks_are_news_until_they_are_published_and_each_change_is_a_version() -> None:
    marks = OwnMarks("a", "x")
    assert (marks.is_news, marks.state) == (False, None)
    first = marks.add(SUBMAPS, "victim", np.zeros(2), "map", 5.0)
    marks.add(SUBMAPS, "door", np.zeros(2), "map", 6.0)
    assert marks.is_news
    message = marks.message()
    assert [(m.label, m.by, m.time) for m in message.marks] == [
        ("victim", "a", 5.0),
        ("door", "a", 6.0),
    ]
    assert not marks.is_news
    assert marks.state is not None and marks.state.version == message.version == 2
    marks.remove(first)
    assert marks.is_news
    assert [mark.label for mark in marks.message().marks] == ["door"]
    with pytest.raises(ArgumentError, match="no mark"):
        marks.remove(first)


def test_nothing_can_be_marked_before_anything_is_mapped() -> None:
    for frame in ("map", "sensor"):
        with pytest.raises(ArgumentError, match="nothing is mapped yet"):
            OwnMarks("a", "x").add((), "victim", np.zeros(2), frame, 5.0)


@pytest.mark.parametrize(
    ("label", "x", "frame", "problem"),
    [
        ("", 1.0, "map", "label: expected 1 to 64"),
        ("a\u001b[2J", 1.0, "map", "label: expected 1 to 64"),
        ("victim", float("nan"), "map", "x: expected a number of at most 50000 .m., got nan"),
        ("victim", float("inf"), "map", "x: expected a number of at most"),
        ("victim", 1.0, "joint", "frame: expected 'map' or 'sensor', got 'joint'"),
    ],
)
def test_what_is_no_mark_is_refused_by_name(label: str, x: float, frame: str, problem: str) -> None:
    with pytest.raises(ArgumentError, match=problem):
        checked(label, x, 0.0, frame)
