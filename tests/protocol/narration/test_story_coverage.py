"""How far a search is, as a person in charge reads it."""

import numpy as np

from mapweave.maps import JointComponent, JointMap, LineMap
from mapweave_protocol.narration.story_coverage import CoverageStory


def hall(length: float, *, closed: bool = False) -> JointMap:
    """Return a hall 4 m wide whose right end nobody has seen, or a wall."""
    walls = [[0.0, 0.0, length, 0.0], [length, 4.0, 0.0, 4.0], [0.0, 4.0, 0.0, 0.0]]
    walls += [[length, 0.0, length, 4.0]] if closed else []
    ring = np.array([[0.0, 0.0], [length, 0.0], [length, 4.0], [0.0, 4.0]])
    count = len(walls)
    lines = LineMap(np.array(walls), np.arange(count), np.ones(count, dtype=np.int64), (ring,))
    robots = {"r2/0": np.zeros(3), "r1/0": np.zeros(3)}
    return JointMap(1, (JointComponent(robots, 1.0, lines, np.ones(count)),), ())


def told(*joints: JointMap) -> list[str]:
    story = CoverageStory()
    return [line for joint in joints for line in story.changed(joint)]


def test_it_is_told_when_it_has_grown_by_half_and_not_before() -> None:
    lines = told(hall(2.0), hall(5.0), hall(6.0), hall(7.4), hall(7.5), hall(7.5))
    assert [line.partition(" searched")[0] for line in lines] == [
        "r1/0 + r2/0: 20 m²",
        "r1/0 + r2/0: 30 m²",
    ]
    assert lines[0].endswith("goes on at 1 frontier, the widest 3.3 m")


def test_when_nothing_is_left_to_search_it_is_told_once() -> None:
    lines = told(hall(5.0), hall(6.0, closed=True), hall(6.0, closed=True))
    assert lines[1:] == ["r1/0 + r2/0: 24 m² searched, nothing left to search"]


def test_of_what_has_no_free_space_nothing_is_told() -> None:
    empty = JointComponent({"r1/0": np.zeros(3)}, 1.0, LineMap.empty(), np.empty(0))
    assert told(JointMap(1, (empty,), ())) == []
