"""The walls of what was joined are made once, as long as all of it stays where it is."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.random import Generator

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.lines.merging import Evolution, MergingParameters, evolve
from mapweave.maps import JointComponent, LineMap
from mapweave.team import joining, joint_builder
from mapweave.team.alignment_graph import Cluster
from mapweave.team.joining import JointParameters, Kept, Piece, join
from mapweave.team.walls import merging_tree
from mapweave.team.walls.segment_confidence import Witness
from tests.mapweave.team.test_joint_optimization import submaps

P = JointParameters()
CLUSTER = Cluster({"a/0": np.zeros(3), "b/0": np.array([0.0, 0.02, 0.001])}, 0.9)
STEP = np.array([0.05, 0.05, 0.004])


def witness(lines: LineMap) -> Witness | None:
    return joint_builder.testify(joint_builder.rasterise(lines, P), P)


@pytest.fixture(name="pieces")
def pieces_fixture(rng: Generator) -> dict[str, list[Piece]]:
    found = {}
    for name in CLUSTER.poses:
        walked = submaps(rng.normal(0.0, 0.003), np.zeros(3))[:8]
        found[name] = [Piece(s.map, witness(s.map), s.pose) for s in walked]
    return found


def joined(pieces: dict[str, list[Piece]], kept: Kept) -> JointComponent:
    kept.turn()
    return join(CLUSTER, pieces, P, kept)


def test_walls_of_pieces_that_stay_are_not_made_again(pieces: dict[str, list[Piece]]) -> None:
    kept = Kept()
    first = joined(pieces, kept)
    for _ in range(3):
        again = joined(pieces, kept)
        assert again.map is first.map
        assert again.segment_confidence is first.segment_confidence


@pytest.mark.parametrize("changed", ["pose", "witness", "order"])
def test_whatever_changes_of_the_pieces_makes_other_walls(
    pieces: dict[str, list[Piece]], changed: str
) -> None:
    kept = Kept()
    first = joined(pieces, kept)
    *others, last = pieces["b/0"]
    other = {
        "pose": [*others, replace(last, pose=se2.compose(last.pose, STEP))],
        "witness": [*others, replace(last, witness=None)],
        "order": [last, *others],
    }[changed]
    now = joined({**pieces, "b/0": other}, kept)
    anew = join(CLUSTER, {**pieces, "b/0": other}, P)
    assert now.map is not first.map
    np.testing.assert_array_equal(now.map.segments, anew.map.segments)
    np.testing.assert_array_equal(now.segment_confidence, anew.segment_confidence)


def test_what_was_merged_of_pieces_that_stay_is_kept_while_nothing_changes(
    pieces: dict[str, list[Piece]], monkeypatch: pytest.MonkeyPatch
) -> None:
    kept = Kept()
    for _ in range(4):
        joined(pieces, kept)
    merged: list[int] = []

    def noted(
        segments: FloatArray, weights: FloatArray, p: MergingParameters, settled: int
    ) -> Evolution:
        merged.append(len(segments))
        return evolve(segments, weights, p, settled)

    monkeypatch.setattr(merging_tree, "evolve", noted)
    *others, last = pieces["b/0"]
    joined({**pieces, "b/0": [*others, replace(last, pose=se2.compose(last.pose, STEP))]}, kept)
    # On the way from a leaf of sixteen to the root, where it was and where it is.
    assert 1 <= len(merged) <= 8


def test_a_cluster_that_is_surer_now_says_so_with_the_same_walls(
    pieces: dict[str, list[Piece]],
) -> None:
    kept = Kept()
    first = joined(pieces, kept)
    surer = joining.join(replace(CLUSTER, confidence=0.95), pieces, P, kept)
    assert surer.map is first.map and surer.confidence == 0.95


def test_walls_joined_before_stay_and_only_what_they_leave_unexplained_is_added() -> None:
    walls = np.array([[0.0, 0, 10, 0], [10, 0, 10, 6], [3, 3, 3.5, 3]])
    support = np.array([200, 200, 10])
    lines = LineMap(walls, np.arange(3), support)
    sure = np.array([0.9, 0.8, 0.5])
    seen = np.array([[0.0, 0.02, 10, 0.02], [14, 0, 14, 6]])
    new = LineMap(seen, np.arange(2), np.array([30, 30]))
    old = Piece(lines, witness(lines), np.zeros(3), sure)
    pieces = {"a/0": [old], "b/0": [Piece(new, witness(new), np.zeros(3))]}
    alone = join(Cluster({"a/0": np.zeros(3)}, 1.0), pieces, P)
    np.testing.assert_array_equal(alone.map.segments, walls)
    np.testing.assert_array_equal(alone.segment_confidence, sure)
    both = join(Cluster({"a/0": np.zeros(3), "b/0": np.zeros(3)}, 1.0), pieces, P)
    order = [np.abs(both.map.segments - wall).max(axis=1).argmin() for wall in [*walls, seen[1]]]
    np.testing.assert_allclose(both.map.segments[order], [*walls, seen[1]], atol=1e-9)
    np.testing.assert_array_equal(both.map.support[order], [230, 200, 10, 30])
    assert both.segment_confidence[order[0]] > 0.9
    assert both.segment_confidence[order[2]] == pytest.approx(0.5)
