"""What is told of a version is what changed, and with the version before it gives all of it."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from mapweave.io.map_files import joint_content
from mapweave.maps import Alignment, JointComponent, JointMap, LineMap
from mapweave.reasons import Reason
from mapweave_fusion_server.web.versions.changes import changes_between
from mapweave_fusion_server.web.versions.json_text import to_json
from mapweave_fusion_server.web.versions.told import WALLS, ToldVersion

ROOM = 4.0  # [m]


def rooms(*places: tuple[float, float]) -> LineMap:
    """Return a square room at each place: its walls are one polyline, its floor one ring."""
    square = (ROOM - 0.2) * np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])
    rings = [np.array(place) + square for place in places]
    walls = [np.hstack([ring, np.roll(ring, -1, axis=0)]) for ring in rings]
    segments = np.concatenate([np.empty((0, 4)), *walls])
    support = 1 + np.arange(len(segments)) % 7
    return LineMap(segments, np.repeat(np.arange(len(rings)), 4), support, tuple(rings))


def component(lines: LineMap, *names: str, sure: float = 0.9) -> JointComponent:
    places = {name: np.array([float(k), 0.0, 0.0]) for k, name in enumerate(names)}
    return JointComponent(places, 0.9, lines, np.full(len(lines.segments), sure))


def alignment(reference: str, other: str, confidence: float = 0.9) -> Alignment:
    place = np.array([1.0, 2.0, 0.3])
    return Alignment(reference, other, place, "accepted", confidence, Reason.words("a test"))


def version(*components: JointComponent, alignments: Sequence[Alignment] = ()) -> JointMap:
    return JointMap(1, components, tuple(alignments))


def changes_of(before: JointMap, after: JointMap) -> dict[str, Any]:
    return changes_between(ToldVersion.of(before), ToldVersion.of(after))


def content_of(joint: JointMap) -> dict[str, Any]:
    return joint_content(joint, searched=False)


def assembled(before: Mapping[str, Any] | None, pieces: list[Any], name: str) -> list[Any]:
    """Return a list of what it is made of, by the rule that is told to programs."""
    whole: list[Any] = []
    for piece in pieces:
        if isinstance(piece, dict):
            whole += piece[name]
        else:
            assert before is not None
            whole += before[name][piece[0] : piece[1]]
    return whole


def made_of(before: dict[str, Any], changes: dict[str, Any]) -> dict[str, Any]:
    components = []
    for change in changes["components"]:
        was = None if change["was"] is None else before["components"][change["was"]]
        lists = {name: assembled(was, change["walls"], name) for name in WALLS}
        lists["free_space"] = assembled(was, change["free_space"], "free_space")
        few = {k: v for k, v in change.items() if k not in ("was", "walls", "free_space")}
        components.append({**few, **lists})
    alignments = assembled(before, changes["alignments"], "alignments")
    return {"components": components, "alignments": alignments}


MAP = rooms(*((ROOM * k, 0.0) for k in range(50)))
ONE = version(component(MAP, "a/0", "b/0"), alignments=[alignment("a/0", "b/0")])
TWO = version(component(rooms((0, 0)), "a/0"), component(rooms((9, 9)), "b/0"))
GROWN = rooms(*((ROOM * k, 0.0) for k in range(50)), (0.0, 40.0))
FEWER = rooms(*((ROOM * k, 0.0) for k in range(50) if k not in (0, 7, 49)))
TWICE = rooms((0, 0), (0, 0), (ROOM, 0), (0, 0))
OTHER = [alignment("a/0", "b/0"), alignment("a/0", "c/0"), alignment("b/0", "c/0", 0.5)]


@pytest.mark.parametrize(
    ("before", "after"),
    [
        (ONE, ONE),
        (ONE, version(component(GROWN, "a/0", "b/0"))),
        (ONE, version(component(FEWER, "a/0", "b/0"))),
        (ONE, version(component(MAP, "a/0", "b/0", sure=0.5))),
        (ONE, version(component(MAP.moved(np.array([1.0, 2.0, 0.3])), "a/0", "b/0"))),
        (ONE, version(component(TWICE, "b/0"), component(MAP, "c/0"), alignments=OTHER)),
        (TWO, ONE),
        (ONE, TWO),
        (version(component(TWICE, "a/0")), version(component(rooms((0, 0)), "a/0"))),
        (version(), ONE),
        (ONE, version()),
        (version(component(LineMap.empty(), "a/0")), version(component(LineMap.empty(), "a/0"))),
    ],
)  # fmt: skip
def test_a_version_is_made_of_the_one_before_it_and_what_changed(
    before: JointMap, after: JointMap
) -> None:
    changes = json.loads(to_json(changes_of(before, after)))
    made = made_of(content_of(before), changes)
    whole = json.loads(to_json(content_of(after)))
    assert made == {name: whole[name] for name in ("components", "alignments")}


def test_what_stayed_is_not_sent() -> None:
    nothing = changes_of(ONE, ONE)
    assert nothing["components"][0]["walls"] == [[0, 50]]
    assert nothing["components"][0]["free_space"] == [[0, 50]]
    assert nothing["alignments"] == [[0, 1]]


def test_of_one_room_that_changed_only_that_is_sent() -> None:
    segments = MAP.segments.copy()
    segments[4 * 20 : 4 * 21] += 0.01
    moved = replace(MAP, segments=segments)
    (change,) = changes_of(ONE, version(component(moved, "a/0", "b/0")))["components"]
    first, new, last = change["walls"]
    assert (first, last) == ([0, 20], [21, 50])
    assert [len(new[name]) for name in WALLS] == [1, 1, 1]
    assert change["free_space"] == [[0, 50]]


def test_a_wall_that_is_less_sure_than_before_is_sent() -> None:
    doubted = version(component(MAP, "a/0", "b/0", sure=0.5))
    (change,) = changes_of(ONE, doubted)["components"]
    (piece,) = change["walls"]
    assert len(piece["segment_confidence"]) == 50
