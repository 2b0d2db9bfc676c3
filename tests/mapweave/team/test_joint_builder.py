"""Versions built from what has changed are those that are built from nothing."""

from dataclasses import replace
from unittest.mock import Mock

import numpy as np
import pytest
from numpy.random import Generator

from mapweave.geometry import se2
from mapweave.kernels.matching import fields
from mapweave.maps import Alignment, JointMap, LineMap, RobotMap, Submap
from mapweave.matching import distance_field
from mapweave.reasons import Reason
from mapweave.team import joining
from mapweave.team.joint_builder import JointMapBuilder, OvertakenError
from mapweave.team.joint_optimization import JointOptimizationParameters
from tests.mapweave.buildings import random_pose, shaken
from tests.mapweave.team.test_joint_optimization import submaps

WEAVING = JointOptimizationParameters(newest=True, at_once=1_000_000)
NAMES = ("a", "b", "c", "d")
STEP = np.array([0.05, 0.05, 0.004])  # [m, m, rad] by which a submap is moved


def builder() -> JointMapBuilder:
    return JointMapBuilder(weaving=WEAVING)


def robot(name: str, rng: Generator) -> RobotMap:
    """Return a robot that walked through the long corridor, in its own frame."""
    walked = submaps(rng.normal(0.0, 0.003), random_pose(rng))[: 3 + int(rng.integers(4))]
    return RobotMap(
        name, "boot", 1, tuple(replace(s, map=shaken(s.map, rng, 0.01)) for s in walked)
    )


def aligned(first: RobotMap, second: RobotMap, rng: Generator, wrong: float = 0.0) -> Alignment:
    """Return an alignment of two robots, which is `wrong` with this probability."""
    transform = se2.compose(first.submaps[0].pose, se2.inverse(second.submaps[0].pose))
    if rng.random() < wrong:
        transform = se2.compose(transform, np.array([3.0, 0.0, 0.0]))
    found = Reason.words("so")
    names = f"{first.robot}/0", f"{second.robot}/0"
    return Alignment(*names, transform, "accepted", float(rng.uniform(0.7, 0.99)), found)


def updated(maps: dict[str, RobotMap], rng: Generator) -> dict[str, RobotMap]:
    """Return the maps after one of them moved a submap, finished one, or saw one better."""
    name = str(rng.choice(sorted(maps)))
    known = list(maps[name].submaps)
    k = int(rng.integers(len(known)))
    what = rng.integers(3)
    if what == 0:
        known[k] = replace(known[k], pose=se2.compose(known[k].pose, rng.normal(0.0, STEP)))
    elif what == 1:
        last = known[-1]
        beyond = submaps(0.0, last.pose)[last.id + 1 : last.id + 2]
        there = se2.compose(last.pose, np.array([6.0, 0.0, 0.0]))
        known += [replace(s, pose=there) for s in beyond]
    else:
        known[k] = replace(known[k], map=shaken(known[k].map, rng, 0.01))
    return {**maps, name: replace(maps[name], submaps=tuple(known))}


def assert_same(one: JointMap, other: JointMap) -> None:
    """They are the same, to the last bit."""
    assert len(one.components) == len(other.components)
    for a, b in zip(one.components, other.components, strict=True):
        assert a.robots.keys() == b.robots.keys() and a.confidence == b.confidence
        for name, pose in a.robots.items():
            np.testing.assert_array_equal(pose, b.robots[name])
        np.testing.assert_array_equal(a.map.segments, b.map.segments)
        np.testing.assert_array_equal(a.map.support, b.map.support)
        np.testing.assert_array_equal(a.map.polyline, b.map.polyline)
        np.testing.assert_array_equal(a.segment_confidence, b.segment_confidence)
        for ours, theirs in zip(a.map.free_space, b.map.free_space, strict=True):
            np.testing.assert_array_equal(ours, theirs)
    for x, y in zip(one.alignments, other.alignments, strict=True):
        assert (x.reference, x.other, x.decision, x.confidence) == (
            *(y.reference, y.other, y.decision, y.confidence),
        )
        assert x.cause == y.cause and x.status == y.status
        np.testing.assert_array_equal(x.transform, y.transform)


def test_a_version_that_is_overtaken_costs_the_next_one_nothing(
    rng: Generator, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What was made for the version before is still there."""
    maps = [robot(name, rng) for name in NAMES]
    alignments = [aligned(maps[0], other, rng) for other in maps[1:]]
    builder = JointMapBuilder(weaving=WEAVING)
    before = builder.build(maps, alignments, 1)
    with pytest.raises(OvertakenError):
        builder.build(maps, alignments, 2, is_overtaken=lambda: True)
    for made in ("_laid_down", "_joined"):
        monkeypatch.delattr(joining, made)
    assert_same(builder.build(maps, alignments, 1), before)


def test_versions_that_compare_a_few_submaps_each_come_to_what_a_patient_one_says(
    rng: Generator,
) -> None:
    """What waited is made up for: in the end nothing tells that it came later."""
    maps = [robot(name, rng) for name in NAMES]
    alignments = [aligned(maps[0], other, rng) for other in maps[1:]]
    few = JointOptimizationParameters(newest=True, at_once=3)
    hasty, patient = JointMapBuilder(weaving=few), JointMapBuilder(weaving=few)
    version = hasty.build(maps, alignments, 1)
    assert hasty.has_more
    while hasty.has_more:
        version = hasty.build(maps, alignments, 1)
    assert_same(version, patient.build(maps, alignments, 1, patient=True))
    assert not patient.has_more


@pytest.mark.parametrize("seed", range(4))
def test_a_version_is_the_same_whatever_was_built_before(seed: int) -> None:
    rng = np.random.default_rng(seed)
    maps = {name: robot(name, rng) for name in NAMES[:2]}
    links: dict[tuple[str, str], Alignment] = {}
    incremental = builder()
    for version in range(1, 9):
        if len(maps) < len(NAMES) and rng.random() < 0.4:
            name = NAMES[len(maps)]
            maps[name] = robot(name, rng)
        elif version > 1:
            maps = updated(maps, rng)
        first, second = sorted(rng.choice(sorted(maps), 2, replace=False).tolist())
        links[first, second] = aligned(maps[first], maps[second], rng, 0.2)
        given = list(maps.values()), list(links.values()), version
        assert_same(incremental.build(*given), builder().build(*given))


def test_what_did_not_change_is_not_rasterised_again(
    rng: Generator, monkeypatch: pytest.MonkeyPatch
) -> None:
    maps = [robot(name, rng) for name in NAMES[:3]]
    links = [aligned(maps[0], maps[1], rng), aligned(maps[1], maps[2], rng)]
    incremental = builder()
    incremental.build(maps, links, 1)
    *others, last = maps[2].submaps
    moved = replace(last, pose=se2.compose(last.pose, STEP))
    maps[2] = replace(maps[2], submaps=(*others, moved))
    drawn = Mock(wraps=fields.rasterised)
    monkeypatch.setattr(distance_field, "rasterised", drawn)
    incremental.build(maps, links, 2)
    assert drawn.call_count == 1  # the component as a whole that has moved within


def test_a_submap_without_walls_is_woven_and_joined(rng: Generator) -> None:
    first, second = robot("a", rng), robot("b", rng)
    blind = Submap(9, 0, np.zeros(3), LineMap.empty(), first.submaps[0].trajectory)
    maps = [replace(first, submaps=(*first.submaps, blind)), second]
    joint = builder().build(maps, [aligned(first, second, rng)], 1)
    assert len(joint.components) == 1 and len(joint.components[0].map.segments)
