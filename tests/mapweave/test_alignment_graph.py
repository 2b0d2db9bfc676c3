"""Alignments that agree carry the poses; one that contradicts surer ones is set aside and named."""

from collections.abc import Sequence

import numpy as np
import pytest
from numpy.random import Generator

from mapweave import se2
from mapweave.alignment_graph import Cluster, GraphParameters, cluster_components
from mapweave.arrays import FloatArray
from mapweave.maps import Alignment, Decision
from tests.mapweave.buildings import random_pose

P = GraphParameters()
NAMES = ["a/0", "b/0", "c/0", "d/0"]
TRUE = {name: random_pose(np.random.default_rng(k), 10) for k, name in enumerate(NAMES)}


def link(
    reference: str,
    other: str,
    confidence: float = 0.9,
    *,
    error: Sequence[float] = (0, 0, 0),
    decision: Decision = "accepted",
) -> Alignment:
    """Return the alignment of two components by their true poses, off by `error` (3,)."""
    true = se2.between(TRUE[reference], TRUE[other])
    return Alignment(
        reference, other, se2.compose(true, error), decision, confidence, "30 m of wall in common"
    )


def assert_true_poses(cluster: Cluster, tolerance: float = 1e-6) -> None:
    first = next(iter(cluster.poses))
    for name, pose in cluster.poses.items():
        np.testing.assert_allclose(pose, se2.between(TRUE[first], TRUE[name]), atol=tolerance)


def assert_same_poses(one: dict[str, FloatArray], other: dict[str, FloatArray]) -> None:
    assert list(one) == list(other)
    for name in one:
        np.testing.assert_allclose(one[name], other[name], atol=1e-9)


CHAIN = [link("a/0", "b/0"), link("c/0", "b/0", 0.8), link("c/0", "d/0", 0.95)]


def test_a_chain_of_links_carries_all_poses_whatever_their_direction() -> None:
    clusters, judged = cluster_components(NAMES, CHAIN, P)
    assert [list(c.poses) for c in clusters] == [NAMES]
    assert_true_poses(clusters[0])
    assert list(judged) == CHAIN


def test_a_cluster_is_as_sure_as_the_weakest_link_it_needs() -> None:
    clusters, _ = cluster_components(NAMES, CHAIN, P)
    assert clusters[0].confidence == 0.8
    # A further, surer way round makes the weak one dispensable.
    clusters, _ = cluster_components(NAMES, [*CHAIN, link("a/0", "c/0", 0.9)], P)
    assert clusters[0].confidence == 0.9


def test_components_without_an_accepted_link_stay_alone_and_sure() -> None:
    links = [link("a/0", "b/0"), link("a/0", "c/0", decision="ambiguous"),
             link("a/0", "d/0", decision="refused")]  # fmt: skip
    clusters, judged = cluster_components(NAMES, links, P)
    assert [list(c.poses) for c in clusters] == [["a/0", "b/0"], ["c/0"], ["d/0"]]
    assert clusters[1].confidence == 1.0
    np.testing.assert_array_equal(clusters[1].poses["c/0"], np.zeros(3))
    assert list(judged) == links


@pytest.mark.parametrize("error", [[1.0, 0, 0], [0, 0, 0.15], [-7, 3, 2.0]])
def test_a_link_that_contradicts_a_circle_is_set_aside_and_named(error: list[float]) -> None:
    wrong = link("a/0", "d/0", 0.7, error=error)
    clusters, judged = cluster_components(NAMES, [*CHAIN, wrong], P)
    without, _ = cluster_components(NAMES, CHAIN, P)
    assert_same_poses(dict(clusters[0].poses), dict(without[0].poses))
    assert list(judged[:3]) == CHAIN
    aside = judged[3]
    assert (aside.reference, aside.other, aside.decision) == ("a/0", "d/0", "ambiguous")
    assert aside.reason == "set aside: contradicts surer alignments; 30 m of wall in common"
    np.testing.assert_array_equal(aside.transform, wrong.transform)


def test_a_link_within_the_tolerance_counts_and_the_poses_are_fitted_to_all() -> None:
    """A triangle with 0.3 m of misclosure: it is shared out, no link keeps all of it."""
    links = [link("a/0", "b/0"), link("b/0", "c/0"), link("a/0", "c/0", 0.8, error=[0.3, 0, 0])]
    clusters, judged = cluster_components(["a/0", "b/0", "c/0"], links, P)
    assert all(one.decision == "accepted" for one in judged)
    poses = clusters[0].poses
    for one in links:
        off = se2.between(one.transform, se2.between(poses[one.reference], poses[one.other]))
        assert 0.01 < np.hypot(off[0], off[1]) < 0.25


def test_the_first_component_of_a_cluster_has_the_identity() -> None:
    for links in (CHAIN, [*CHAIN, link("a/0", "d/0", 0.9, error=[0.1, 0, 0])]):
        clusters, _ = cluster_components(NAMES, links, P)
        np.testing.assert_array_equal(clusters[0].poses["a/0"], np.zeros(3))


def test_the_order_of_the_links_changes_nothing(rng: Generator) -> None:
    links = [*CHAIN, link("a/0", "d/0", 0.7, error=[2, 0, 0]), link("a/0", "c/0", 0.85)]
    first, _ = cluster_components(NAMES, links, P)
    for _ in range(5):
        shuffled = [links[k] for k in rng.permutation(len(links))]
        again, judged = cluster_components(NAMES, shuffled, P)
        for name, pose in first[0].poses.items():
            np.testing.assert_allclose(again[0].poses[name], pose, atol=1e-6)
        assert [a.other for a in judged if a.decision == "ambiguous"] == ["d/0"]


def test_the_largest_cluster_comes_first() -> None:
    links = [link("b/0", "c/0"), link("c/0", "d/0")]
    clusters, _ = cluster_components(NAMES, links, P)
    assert [len(c.poses) for c in clusters] == [3, 1]


def test_alignments_of_unknown_components_are_left_out() -> None:
    clusters, judged = cluster_components(["a/0", "b/0"], CHAIN, P)
    assert [list(c.poses) for c in clusters] == [["a/0", "b/0"]]
    assert list(judged) == [CHAIN[0]]


def test_nothing_gives_nothing() -> None:
    assert cluster_components([], [], P) == ([], ())
