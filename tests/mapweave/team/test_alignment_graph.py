"""Alignments that agree carry the poses; one that contradicts surer ones is set aside and named."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
import pytest
from numpy.random import Generator

from mapweave.evidence import Evidence
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.maps import Alignment, Decision, LineMap
from mapweave.matching.distance_field import DistanceField, DistanceFieldParameters
from mapweave.reasons import Reason, ReasonKind, Status, StatusKind
from mapweave.team.alignment_graph import AlignmentGraphParameters, Cluster, cluster_components
from tests.mapweave.buildings import BUILDING, part, random_pose

P = AlignmentGraphParameters()
FOUND = Reason.words("30 m of wall in common")
DECISIONS: tuple[Decision, ...] = "accepted", "ambiguous", "refused"
NAMES = ["a/0", "b/0", "c/0", "d/0"]
TRUE = {name: random_pose(np.random.default_rng(k), 10) for k, name in enumerate([*NAMES, "e/0"])}


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
    return Alignment(reference, other, se2.compose(true, error), decision, confidence, FOUND)


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
    assert [(a.decision, a.confidence, a.cause) for a in judged] == [
        (a.decision, a.confidence, a.cause) for a in CHAIN
    ]


def test_a_cluster_is_as_sure_as_the_weakest_link_it_needs() -> None:
    clusters, _ = cluster_components(NAMES, CHAIN, P)
    assert clusters[0].confidence == pytest.approx(0.8)
    # A further way round makes the weak one dispensable.
    clusters, _ = cluster_components(NAMES, [*CHAIN, link("a/0", "c/0", 0.9)], P)
    assert clusters[0].confidence == pytest.approx(0.95)


def test_bent_maps_make_a_component_less_sure_and_their_places_decide_what_is_relied_on() -> None:
    """Two that agree about the place outweigh a third, however little each is sure of the rest."""
    circle = [("a/0", "b/0"), ("b/0", "c/0"), ("a/0", "c/0")]
    links = [replace(link(*pair, 0.3), evidence=Evidence(place=0.97)) for pair in circle]
    for count in (2, 3):  # a circle proves the places, and tells nothing of the bends
        (bent,), judged = cluster_components(NAMES[:3], links[:count], P)
        assert bent.confidence == pytest.approx(0.3, abs=0.01)
        assert [a.confidence for a in judged] == [0.3] * count
    lonely = replace(link(*circle[2], 0.6, error=(9, 0, 0)), evidence=Evidence(place=0.6))
    _, judged = cluster_components(NAMES[:3], [*links[:2], lonely], P)
    assert [a.decision for a in judged] == ["accepted", "accepted", "ambiguous"]


@pytest.mark.parametrize(("reach", "joined"), [(0.0, False), (40.0, True), (1e9, True)])
def test_a_circle_of_bent_maps_may_miss_by_what_they_are_bent(reach: float, joined: bool) -> None:
    pairs = [("a/0", "b/0"), ("b/0", "c/0"), ("a/0", "c/0")]
    evidence = Evidence(place=0.97, reach=reach)
    links = [replace(link(*pair, 0.9), evidence=evidence) for pair in pairs[:2]]
    off = replace(link(*pairs[2], 0.9, error=(1.4, 0, 0)), evidence=evidence)
    _, judged = cluster_components(NAMES[:3], [*links, off], P)
    assert all(a.decision == "accepted" for a in judged) == joined


def test_no_reach_excuses_another_place() -> None:
    evidence = Evidence(place=0.97, reach=1e300)
    pairs = [("a/0", "b/0"), ("b/0", "c/0"), ("a/0", "c/0")]
    links = [replace(link(*pair, 0.9), evidence=evidence) for pair in pairs[:2]]
    off = replace(link(*pairs[2], 0.9, error=(9.0, 0, 0)), evidence=evidence)
    _, judged = cluster_components(NAMES[:3], [*links, off], P)
    assert not all(a.decision == "accepted" for a in judged)


def test_the_way_around_a_bent_map_counts() -> None:
    """Of two ways to a component the one that is less bent tells how sure it is."""
    sure = [
        replace(link(*p, 0.9), evidence=Evidence(place=0.9))
        for p in (("a/0", "b/0"), ("b/0", "c/0"))
    ]
    bent = replace(link("a/0", "c/0", 0.2), evidence=Evidence(place=0.9))
    (cluster,), _ = cluster_components(NAMES[:3], [*sure, bent], P)
    assert cluster.confidence > 0.9


@pytest.mark.parametrize("away", range(4))
def test_poses_follow_exact_links_where_a_bent_one_misses(away: int) -> None:
    pairs = [("a/0", "b/0"), ("b/0", "c/0"), ("a/0", "c/0")]
    exact = Evidence(place=0.97, reach=0.0)
    links = [replace(link(*pair, 0.95), evidence=exact) for pair in pairs[:2]]
    error = [np.cos(away * np.pi / 2), np.sin(away * np.pi / 2), 0.0]
    off = replace(link(*pairs[2], 0.3, error=error), evidence=Evidence(place=0.97, reach=50.0))
    (cluster,), _ = cluster_components(NAMES[:3], [*links, off], P)
    assert_true_poses(cluster, 0.15)


@pytest.mark.parametrize("place", [-1e9, 0.0, 1e9, np.nan])
def test_a_place_that_is_no_probability_breaks_nothing(place: float) -> None:
    odd = replace(CHAIN[0], evidence=Evidence(place=place))
    (cluster,), _ = cluster_components(NAMES[:2], [odd], P)
    assert 0 <= cluster.confidence <= 1


def test_components_without_an_accepted_link_stay_alone_and_sure() -> None:
    links = [link("a/0", "b/0"), link("a/0", "c/0", decision="ambiguous"),
             link("a/0", "d/0", decision="refused")]  # fmt: skip
    clusters, judged = cluster_components(NAMES, links, P)
    assert [list(c.poses) for c in clusters] == [["a/0", "b/0"], ["c/0"], ["d/0"]]
    assert clusters[1].confidence == 1.0
    np.testing.assert_array_equal(clusters[1].poses["c/0"], np.zeros(3))
    assert [a.status for a in judged] == [Status(StatusKind.RELIED_ON), None, None]
    assert [(a.decision, a.cause) for a in judged] == [(a.decision, a.cause) for a in links]


@pytest.mark.parametrize("error", [[1.0, 0, 0], [0, 0, 0.15], [-7, 3, 2.0]])
def test_a_link_that_contradicts_a_circle_is_set_aside_and_named(error: list[float]) -> None:
    wrong = link("a/0", "d/0", 0.7, error=error)
    clusters, judged = cluster_components(NAMES, [*CHAIN, wrong], P)
    without, _ = cluster_components(NAMES, CHAIN, P)
    assert_same_poses(dict(clusters[0].poses), dict(without[0].poses))
    assert [a.decision for a in judged[:3]] == ["accepted"] * 3
    # The others may be wrong instead: all are less sure than they were.
    for before, after in zip([*CHAIN, wrong], judged, strict=True):
        assert after.confidence < before.confidence
    aside = judged[3]
    assert (aside.reference, aside.other, aside.decision) == ("a/0", "d/0", "ambiguous")
    off, turn = np.hypot(error[0], error[1]), np.degrees(error[2])
    assert aside.reason == (
        f"set aside: {off:.1f} m and {turn:.0f}° off what a/0-b/0, c/0-b/0 and c/0-d/0 say;"
        " 30 m of wall in common"
    )
    by = ("a/0", "b/0"), ("c/0", "b/0"), ("c/0", "d/0")
    assert aside.status == Status(StatusKind.SET_ASIDE, by)
    assert aside.cause.kind is ReasonKind.OTHERS_CONTRADICT
    assert aside.cause.found == FOUND
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


@dataclass(frozen=True)
class Team:
    """Robots with true poses, alignments that are right but for noise, and one that is wrong."""

    names: list[str]
    poses: dict[str, FloatArray]
    links: list[Alignment]
    wrong: Alignment


def random_team(rng: Generator) -> Team:
    """Return a team of 4 to 8 whose right alignments join the wrong one's ends twice over."""
    names = [f"r{k}/0" for k in range(rng.integers(4, 9))]
    poses = {name: random_pose(rng, 12) for name in names}
    around = [(k, (k + 1) % len(names)) for k in rng.permutation(len(names))]
    across = [(a, b) for a, b in combinations(range(len(names)), 2) if rng.random() < 0.3]
    pairs = sorted({(min(pair), max(pair)) for pair in [*around, *across]})

    def align(pair: tuple[int, int], error: FloatArray, confidence: float) -> Alignment:
        a, b = (names[k] for k in pair)
        transform = se2.compose(se2.between(poses[a], poses[b]), error)
        return Alignment(a, b, transform, "accepted", confidence, FOUND)

    links = [
        align(pair, rng.normal(0, [0.05, 0.05, 0.005]), rng.uniform(0.7, 0.97)) for pair in pairs
    ]
    away = rng.uniform(-1, 1, 3) * [20, 20, np.pi] + [3, 0, 0]
    one, other = rng.choice(len(names), 2, replace=False)
    return Team(names, poses, links, align((one, other), away, 0.99))


@pytest.mark.parametrize("seed", range(25))
def test_one_wrong_alignment_the_surest_of_all_is_set_aside_and_named(seed: int) -> None:
    """Wherever it is in a graph of cycles: what comes out is as without it."""
    team = random_team(np.random.default_rng(seed))
    (without,), _ = cluster_components(team.names, team.links, P)
    (cluster,), judged = cluster_components(team.names, [team.wrong, *team.links], P)
    assert [a.decision for a in judged] == ["ambiguous"] + ["accepted"] * len(team.links)
    assert judged[0].status is not None and judged[0].status.kind is StatusKind.SET_ASIDE
    assert judged[0].confidence < 0.5
    assert_same_poses(dict(cluster.poses), dict(without.poses))
    first = team.poses[team.names[0]]
    for name, pose in cluster.poses.items():
        off = se2.between(se2.between(first, team.poses[name]), pose)
        assert np.hypot(off[0], off[1]) < 0.5
    assert cluster.confidence <= without.confidence


def rasters_of(maps: Mapping[str, LineMap]) -> dict[str, DistanceField]:
    return {
        name: DistanceField.of(lines, DistanceFieldParameters()) for name, lines in maps.items()
    }


@pytest.mark.parametrize("seed", range(4))
def test_other_frames_change_nothing(seed: int) -> None:
    """Each component in a frame of its own choice: the same decisions, the same shape."""
    rng = np.random.default_rng(seed)
    team = random_team(rng)
    links = [team.wrong, *team.links]
    frames = {name: random_pose(rng) for name in team.names}
    maps = {name: part(BUILDING, 0, 9).moved(random_pose(rng, 3)) for name in team.names}
    maps = {name: replace(lines, free_space=()) for name, lines in maps.items()}
    moved = [
        replace(
            a,
            transform=se2.compose(
                frames[a.reference], se2.compose(a.transform, se2.inverse(frames[a.other]))
            ),
        )
        for a in links
    ]
    maps_moved = {name: maps[name].moved(frames[name]) for name in team.names}
    (here,), judged = cluster_components(team.names, links, P, rasters_of(maps))
    (there,), judged_there = cluster_components(team.names, moved, P, rasters_of(maps_moved))
    assert [a.reason for a in judged] == [a.reason for a in judged_there]
    assert there.confidence == pytest.approx(here.confidence)
    first = team.names[0]
    for name in team.names:
        expected = se2.compose(
            frames[first], se2.compose(here.poses[name], se2.inverse(frames[name]))
        )
        np.testing.assert_allclose(there.poses[name], expected, atol=2e-3)  # [m], as fitted


def test_one_more_robot_joins_two_clusters() -> None:
    apart = [link("a/0", "b/0"), link("d/0", "c/0")]
    clusters, _ = cluster_components(NAMES, apart, P)
    assert [list(c.poses) for c in clusters] == [["a/0", "b/0"], ["c/0", "d/0"]]
    joining = [link("e/0", "b/0", 0.7), link("e/0", "d/0", 0.8)]
    (cluster,), _ = cluster_components([*NAMES, "e/0"], [*apart, *joining], P)
    assert_true_poses(cluster)
    assert cluster.confidence == pytest.approx(0.7)


def test_two_alignments_of_one_pair_that_agree_are_surer_than_one() -> None:
    twice = [link("a/0", "b/0", 0.8), link("b/0", "a/0", 0.7)]
    (cluster,), judged = cluster_components(["a/0", "b/0"], twice, P)
    assert [(a.decision, a.confidence) for a in judged] == [("accepted", 0.8), ("accepted", 0.7)]
    assert cluster.confidence > 0.99


def test_three_that_contradict_each_other_alike_join_no_three() -> None:
    links = [link("a/0", "b/0"), link("b/0", "c/0"), link("a/0", "c/0", error=[5, 0, 0])]
    clusters, judged = cluster_components(["a/0", "b/0", "c/0"], links, P)
    assert [len(c.poses) for c in clusters] == [2, 1]
    assert clusters[0].confidence < 0.7
    aside = [a for a in judged if a.decision == "ambiguous"]
    assert [a.status for a in aside] == [Status(StatusKind.SET_ASIDE)] * 2
    assert [a.cause for a in aside] == [Reason(ReasonKind.UNDECIDED, found=FOUND)] * 2
    assert all("nothing tells for sure which is wrong" in a.reason for a in aside)


def test_what_is_relied_on_only_because_the_robots_met_before_is_held() -> None:
    kept = replace(CHAIN[0], cause=Reason(ReasonKind.MET_BEFORE, found=FOUND))
    _, judged = cluster_components(NAMES, [kept, *CHAIN[1:]], P)
    assert [a.status for a in judged] == [
        Status(StatusKind.HELD),
        Status(StatusKind.RELIED_ON),
        Status(StatusKind.RELIED_ON),
    ]


def test_what_others_say_became_of_an_alignment_is_not_believed() -> None:
    """A joint map judges for itself."""
    said = Status(StatusKind.REVOKED, revoked_in=7)
    links = [replace(link("a/0", "b/0", decision=d), status=said) for d in DECISIONS]
    _, judged = cluster_components(NAMES, links, P)
    assert [a.status for a in judged] == [Status(StatusKind.RELIED_ON), None, None]


def test_the_largest_cluster_comes_first() -> None:
    links = [link("b/0", "c/0"), link("c/0", "d/0")]
    clusters, _ = cluster_components(NAMES, links, P)
    assert [len(c.poses) for c in clusters] == [3, 1]


def test_alignments_of_unknown_components_are_left_out() -> None:
    clusters, judged = cluster_components(["a/0", "b/0"], CHAIN, P)
    assert [list(c.poses) for c in clusters] == [["a/0", "b/0"]]
    assert [(a.reference, a.other) for a in judged] == [("a/0", "b/0")]


def test_nothing_gives_nothing() -> None:
    assert cluster_components([], [], P) == ([], ())
