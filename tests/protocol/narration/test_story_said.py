"""Marks and orders are told once, and again when they change."""

from dataclasses import replace

import numpy as np

from mapweave.maps import JointComponent, JointMap, LineMap
from mapweave.marks import PlacedMark
from mapweave.orders import Order, OrderEffect, OrderKind
from mapweave_protocol.narration.story_said import SaidStory

BAN = Order("o1", OrderKind.FORBID, "anna", 5.0, "two floors", "a/0", "b/0")
FORGET = Order("o2", OrderKind.FORGET, "ben", 6.0, "by hand", robot="a", boots=("x", "y"))


def joint(version: int, *orders: Order, victim: tuple[float, float] | None = None) -> JointMap:
    marks: tuple[PlacedMark, ...] = ()
    if victim is not None:
        marks = (PlacedMark("m1", "victim", "r1", 5.0, "b/0", np.array(victim)),)
    robots = {"a/0": np.zeros(3), "b/0": np.zeros(3)}
    component = JointComponent(robots, 1.0, LineMap.empty(), np.empty(0), marks)
    return JointMap(version, (component,), (), orders=orders)


def test_an_order_is_told_when_it_comes_when_its_effect_changes_and_when_it_goes() -> None:
    story = SaidStory()
    waits = replace(BAN, effect=OrderEffect.WAITS)
    told = [
        list(story.changed(each))
        for each in (joint(1), joint(2, waits), joint(3, BAN), joint(4, BAN, FORGET), joint(5))
    ]
    assert told == [
        [],
        ["anna forbids a/0 and b/0: two floors; it waits, as that is not here"],
        ["anna forbids a/0 and b/0: two floors"],
        ["ben forgets a@x, y: by hand"],
        ["taken back: anna forbids a/0 and b/0", "taken back: ben forgets a@x, y"],
    ]


def test_a_mark_is_told_when_it_comes_when_it_has_moved_far_and_when_it_goes() -> None:
    story = SaidStory()
    places = [None, (1.0, 2.0), (1.1, 2.1), (3.0, 2.0), None]
    told = [list(story.changed(joint(k, victim=place))) for k, place in enumerate(places)]
    assert told == [
        [],
        ["r1 marks 'victim' at 1.0, 2.0 m of a/0"],
        [],
        ["r1 has a mark moved: 'victim' at 3.0, 2.0 m of a/0"],
        ["no longer marked: 'victim' by r1"],
    ]
