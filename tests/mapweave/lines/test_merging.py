"""Discrete Segment Evolution: sightings of one surface become one segment (paper, VI)."""

from itertools import islice, pairwise
from pathlib import Path

import numpy as np
import pytest

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray, IntArray
from mapweave.io.readers import read_reference_poses, read_scans
from mapweave.kernels.lines.merging_cost import Pairs
from mapweave.kernels.lines.merging_rules import Pairing
from mapweave.lines.merging import Evolution, MergingParameters, count_support, evolve, merge_scan
from mapweave.lines.merging_cost import merge_cost
from mapweave.lines.slivers import absorb_slivers
from mapweave.scan.segmentation import extract_segments

# An L-shaped room, walked round counter-clockwise: its inside is on the left of every wall.
CORNERS = np.array([[0, 0], [6, 0], [6, 4], [3, 4], [3, 3], [0, 3]], dtype=float)
ROOM = np.hstack([CORNERS, np.roll(CORNERS, -1, axis=0)])


def lengths_of(segments: FloatArray) -> FloatArray:
    return np.asarray(np.hypot(*(segments[:, 2:] - segments[:, :2]).T))


def sightings(walls: FloatArray, scans: int, seed: int) -> tuple[FloatArray, IntArray]:
    """Return what noisy scans (2 cm) saw of `walls`, cut anywhere, and which scan saw it."""
    random = np.random.default_rng(seed)
    seen: list[FloatArray] = []
    scan_of: list[int] = []
    for scan in range(scans):
        for wall in walls:
            cuts = np.sort(np.concatenate([[0, 1], random.uniform(0, 1, random.integers(0, 3))]))
            for low, high in pairwise(cuts):
                along = wall[2:] - wall[:2]
                if random.random() < 0.3 or (high - low) * np.hypot(*along) < 0.3:
                    continue
                part = np.concatenate([wall[:2] + low * along, wall[:2] + high * along])
                seen.append(part + random.normal(0, 0.02, 4))
                scan_of.append(scan)
    return np.array(seen), np.array(scan_of)


def assert_same_walls(found: FloatArray, walls: FloatArray, tolerance: float) -> None:
    """Check that there is one segment for each wall, with the same ends and direction."""
    assert len(found) == len(walls)
    error = np.abs(found[:, None] - walls).max(axis=-1)
    assert sorted(np.argmin(error, axis=1)) == list(range(len(walls)))
    assert error.min(axis=1).max() < tolerance


def distance_to(segments: FloatArray, points: FloatArray) -> FloatArray:
    """Return (n,) how far each point is from the nearest segment [m]."""
    start, along = segments[:, :2], segments[:, 2:] - segments[:, :2]
    offset = points[:, None] - start
    share = np.clip((offset * along).sum(axis=-1) / (along**2).sum(axis=-1), 0, 1)
    return np.asarray(np.linalg.norm(offset - share[..., None] * along, axis=-1).min(axis=1))


def merges(first: list[float], second: list[float]) -> bool:
    return len(evolve(np.array([first, second], dtype=float)).segments) == 1


def naive_evolution(segments: FloatArray, parameters: MergingParameters) -> Evolution:
    """Compare all pairs before every merge, and merge the cheapest."""
    weights = lengths_of(segments)
    pairing = Pairing(segments, weights, parameters.rules)
    groups = [{i} for i in range(len(segments))]
    while True:
        younger, older = np.tril_indices(len(segments), -1)
        pairs = Pairs.of(segments[younger], segments[older], weights[younger], weights[older])
        costs = pairing.cost(pairs)
        if not len(costs) or not np.isfinite(costs.min()):
            break
        i, j = younger[np.argmin(costs)], older[np.argmin(costs)]
        pair = Pairs.of(segments[[i]], segments[[j]], weights[[i]], weights[[j]])
        kept = [k for k in range(len(segments)) if k not in (i, j)]
        segments = np.concatenate([segments[kept], pairing.merged(pair)])
        weights = np.append(weights[kept], weights[i] + weights[j])
        groups = [*(groups[k] for k in kept), groups[i] | groups[j]]
    labels = np.empty(sum(map(len, groups)), dtype=np.int64)
    for label, group in enumerate(groups):
        labels[list(group)] = label
    return Evolution(segments, weights, labels)


@pytest.mark.parametrize("seed", range(12))
def test_the_queue_always_merges_the_cheapest_pair(seed: int) -> None:
    random = np.random.default_rng(seed)
    if seed % 2:
        segments, _ = sightings(ROOM, 4, seed)
    else:  # disorder: short segments anywhere in a small box
        centre, half = random.uniform(0, 1, (40, 2)), random.normal(0, 0.15, (40, 2))
        segments = np.hstack([centre - half, centre + half])
    expected = naive_evolution(segments, MergingParameters())
    found = evolve(segments)
    assert len(expected.segments) < len(segments)
    np.testing.assert_allclose(found.segments, expected.segments, atol=1e-9)
    np.testing.assert_allclose(found.weights, expected.weights)
    np.testing.assert_array_equal(found.labels, expected.labels)


@pytest.mark.parametrize("seed", range(3))
def test_a_room_seen_in_50_noisy_scans_is_one_segment_a_wall(seed: int) -> None:
    segments, _ = sightings(ROOM, 50, seed)
    assert_same_walls(evolve(segments).segments, ROOM, tolerance=0.08)


def test_a_room_mapped_scan_by_scan_is_one_segment_a_wall() -> None:
    segments, scan_of = sightings(ROOM, 50, 7)
    known, weights = np.empty((0, 4)), np.empty(0)
    for scan in range(50):
        evolution = merge_scan(known, weights, segments[scan_of == scan])
        known, weights = evolution.segments, evolution.weights
    assert_same_walls(known, ROOM, tolerance=0.08)
    assert weights.sum() == pytest.approx(lengths_of(segments).sum())


def test_a_rotated_and_moved_room_becomes_the_same_room() -> None:
    segments, _ = sightings(ROOM, 10, 8)
    for motion in np.random.default_rng(8).uniform(-3, 3, (3, 3)):
        found = evolve(se2.transform_segments(motion, segments)).segments
        assert_same_walls(found, se2.transform_segments(motion, ROOM), tolerance=0.1)


def test_two_sightings_5_cm_apart_are_one_wall() -> None:
    assert merges([0, 0, 3, 0], [0.5, 0.05, 3.4, 0.05])


def test_sightings_of_a_long_wall_fan_out_as_poses_turn() -> None:
    """15 cm apart: of 8 m that is a scan turned by a degree, of 1 m it is another surface."""
    assert merges([0, 0, 8, 0], [0, 0.15, 8, 0.15])
    assert not merges([0, 0, 1, 0], [0, 0.15, 1, 0.15])


@pytest.mark.parametrize(("apart", "cost", "one"), [(0.20, 0.15, True), (0.29, 0.2175, False)])
def test_merging_stops_at_a_cost_of_20_cm(apart: float, cost: float, one: bool) -> None:
    """Of two equal parallel walls of 11 m, none of which any other rule keeps apart."""
    first, second = [0.0, 0, 11, 0], [0.0, apart, 11, apart]
    assert merge_cost(np.array([first]), np.array([second]))[0] == pytest.approx(cost)
    assert merges(first, second) == one


def test_what_a_pair_costs_is_reckoned_in_the_main_direction_that_it_would_follow() -> None:
    """Two pieces of one straight line, 3° off the walls: each is turned, at 2 l tan 3° (VII)."""
    walls = np.array([[0, y, 20, y] for y in (5, 6, 7)], dtype=float)
    ahead = np.array([np.cos(np.deg2rad(3)), np.sin(np.deg2rad(3))])
    line = np.array([np.concatenate([k * ahead, (k + 1) * ahead]) for k in (0, 1)])
    turned = 2 * np.tan(np.deg2rad(3))  # 0.105 m
    for limit, pieces in ((0.9 * turned, 2), (1.1 * turned, 1)):
        parameters = MergingParameters(max_cost=limit)
        found = evolve(np.concatenate([walls, line]), None, parameters)
        assert len(found.segments) == len(walls) + pieces


def test_opposite_faces_are_never_one_wall() -> None:
    assert not merges([0, 0, 3, 0], [3, 0, 0, 0])
    assert not merges([0, 0, 3, 0], [3, -0.1, 0, -0.1])


@pytest.mark.parametrize("width", [0.7, 0.8, 0.9])
def test_a_door_opening_is_not_bridged(width: float) -> None:
    assert not merges([0, 0, 3, 0], [3 + width, 0, 6, 0])


def test_a_lost_beam_or_two_do_not_break_a_wall() -> None:
    assert merges([0, 0, 3, 0], [3.15, 0, 6, 0])


@pytest.mark.parametrize("length", [0.5, 3.0, 10.0])
def test_parallel_surfaces_30_cm_apart_stay_apart(length: float) -> None:
    assert not merges([0, 0, length, 0], [0, 0.3, length, 0.3])


def test_a_well_known_wall_hardly_moves_to_a_new_sighting() -> None:
    merged = evolve(np.array([[0, 0, 4, 0], [0, 0.06, 4, 0.06]]), np.array([400.0, 4.0]))
    assert merged.segments.shape == (1, 4)
    assert np.abs(merged.segments[0, [1, 3]]).max() < 0.002
    assert merged.weights[0] == pytest.approx(404)


def test_a_merged_wall_follows_the_main_direction_near_it() -> None:
    """Quantising the direction copes with errors that accumulate (paper, VII)."""
    straight = np.array([[0, y, 5, y] for y in range(1, 11)], dtype=float)
    skew = np.array([[0, 0, 1, 0.02], [1, 0.02, 2, 0.03]])
    merged = evolve(np.concatenate([straight, skew])).segments
    assert len(merged) == 11
    np.testing.assert_allclose(
        merged[-1, 1], merged[-1, 3], atol=2e-3
    )  # 0.03 when it follows its parts


@pytest.mark.parametrize("degrees", [10, 100, 190, 280])
def test_a_merged_wall_shows_the_side_that_its_parts_do(degrees: float) -> None:
    """Whichever way its main direction, that of a line, is taken to run."""
    ahead = np.array([np.cos(np.deg2rad(degrees)), np.sin(np.deg2rad(degrees))])
    parts = np.array([np.concatenate([k * ahead, (k + 3) * ahead]) for k in (0, 2)])
    np.testing.assert_allclose(evolve(parts).segments, [[0, 0, *5 * ahead]], atol=1e-9)


def test_ends_within_the_noise_are_one_end_and_farther_ones_are_not() -> None:
    """Averaged by weight, which is 3 to 1; the hull has the outer ones."""
    parameters = MergingParameters(end_noise=0.1)
    parts = np.array([[0.0, 0, 3, 0], [0.08, 0, 3.4, 0]])
    merged = evolve(parts, np.array([3.0, 1.0]), parameters).segments
    np.testing.assert_allclose(merged, [[0.02, 0, 3.4, 0]], atol=1e-9)


def test_an_oblique_wall_stays_oblique_though_a_main_direction_is_near() -> None:
    straight = np.array([[0, y, 5, y] for y in range(2, 12)], dtype=float)
    angle = np.deg2rad(3)
    oblique = np.array([0, 0, 5 * np.cos(angle), 5 * np.sin(angle)])
    merged = evolve(np.concatenate([straight, [oblique, oblique]])).segments
    assert len(merged) == 11
    np.testing.assert_allclose(merged[-1], oblique, atol=1e-6)


def test_labels_and_weights_account_for_every_input() -> None:
    segments, _ = sightings(ROOM, 20, 9)
    evolution = evolve(segments)
    assert evolution.labels.shape == (len(segments),)
    assert set(evolution.labels) == set(range(len(evolution.segments)))
    total = np.bincount(evolution.labels, lengths_of(segments))
    np.testing.assert_allclose(evolution.weights, total)


def test_labels_name_the_wall_that_each_sighting_belongs_to() -> None:
    segments, _ = sightings(ROOM, 20, 10)
    evolution = evolve(segments)
    middle = (segments[:, :2] + segments[:, 2:]) / 2
    wall = evolution.segments[evolution.labels]
    along = (wall[:, 2:] - wall[:, :2]) / lengths_of(wall)[:, None]
    offset = middle - wall[:, :2]
    assert np.abs(along[:, 0] * offset[:, 1] - along[:, 1] * offset[:, 0]).max() < 0.1


def test_what_was_merged_does_not_merge_further() -> None:
    segments, _ = sightings(ROOM, 10, 11)
    once = evolve(segments)
    twice = evolve(once.segments, once.weights)
    np.testing.assert_array_equal(twice.segments, once.segments)


def test_a_scan_is_paired_with_the_map_and_labels_follow_both() -> None:
    known = np.array([[0, 0, 4, 0], [10, 0, 14, 0]], dtype=float)
    scan = np.array([[1, 0.04, 3, 0.04], [3, 5, 5, 5], [10, -0.02, 12, -0.02]], dtype=float)
    evolution = merge_scan(known, np.array([40.0, 40.0]), scan)
    assert len(evolution.segments) == 3
    first, second, *of_scan = evolution.labels.tolist()
    assert of_scan[0] == first
    assert of_scan[2] == second
    assert of_scan[1] not in (first, second)
    assert evolution.weights[first] == pytest.approx(42)
    np.testing.assert_allclose(evolution.segments[of_scan[1]], scan[1])


def test_what_a_scan_saw_of_a_known_wall_goes_to_it_and_not_to_its_neighbour_in_the_scan() -> None:
    """A scan turned by a degree saw 12 m in two pieces; as one they would be off the 4 m known."""
    known = np.array([[0.0, 0, 4, 0]])
    scan = np.array([[0, 0.02, 4, 0.10], [4, 0.10, 12, 0.26]])
    wall, near, far = merge_scan(known, np.array([400.0]), scan).labels
    assert near == wall
    assert far != wall


@pytest.mark.parametrize("order", [[0, 1], [1, 0]])
def test_of_two_known_walls_the_nearer_one_gets_what_a_scan_saw(order: list[int]) -> None:
    known = np.array([[0.0, 0, 1, 0], [0.0, 0.16, 1, 0.16]])[order]
    scan = np.array([[0.0, 0.1, 1, 0.1]])
    *walls, seen = merge_scan(known, np.array([40.0, 40.0]), scan).labels.tolist()
    assert seen == walls[order.index(1)]


def test_a_scan_joins_two_parts_of_a_wall() -> None:
    known = np.array([[0, 0, 2, 0], [3, 0, 5, 0]], dtype=float)
    evolution = merge_scan(known, np.array([2.0, 2.0]), np.array([[1.0, 0, 4, 0]]))
    np.testing.assert_allclose(evolution.segments, [[0, 0, 5, 0]], atol=1e-9)
    assert evolution.labels.tolist() == [0, 0, 0]


def test_pieces_of_a_new_wall_in_one_scan_are_merged() -> None:
    scan = np.array([[0, 9, 2, 9], [2, 9.01, 4, 9.01]])
    evolution = merge_scan(ROOM, lengths_of(ROOM), scan)
    assert len(evolution.segments) == len(ROOM) + 1


def test_the_first_scan_is_the_first_map() -> None:
    """G_1 is S_1 (paper, V)."""
    evolution = merge_scan(np.empty((0, 4)), np.empty(0), ROOM)
    np.testing.assert_array_equal(evolution.segments, ROOM)


def test_an_empty_scan_changes_nothing() -> None:
    evolution = merge_scan(ROOM, lengths_of(ROOM), np.empty((0, 4)))
    np.testing.assert_array_equal(evolution.segments, ROOM)
    np.testing.assert_array_equal(evolution.labels, np.arange(len(ROOM)))


def test_nothing_evolves_into_nothing() -> None:
    evolution = evolve(np.empty((0, 4)))
    assert evolution.segments.shape == (0, 4)
    assert evolution.labels.shape == (0,)


def test_support_counts_scans_not_sightings() -> None:
    labels = np.array([0, 0, 0, 1, 1])
    scans = np.array([4, 4, 5, 4, 4])
    assert count_support(labels, scans).tolist() == [2, 1]
    assert count_support(np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64)).tolist() == []


def test_few_segments_explain_the_returns_of_real_scans(data_dir: Path) -> None:
    """As in the paper's figure 2: lines of aligned scans become a map of few segments."""
    log = data_dir / "fr079-dense.log.gz"
    index, pose = read_reference_poses(log)
    poses = dict(zip(index.tolist(), pose, strict=True))
    known, weights, put_in = np.empty((0, 4)), np.empty(0), 0
    returns: list[FloatArray] = []
    for scan in islice(read_scans(log, on_warning=pytest.fail), 1000, 1100):
        segments = extract_segments(scan).segments
        placed = se2.transform_segments(poses[scan.index], segments)
        evolution = merge_scan(known, weights, placed)
        known, weights = evolution.segments, evolution.weights
        put_in += len(segments)
        near = scan.hits & (np.nan_to_num(scan.ranges, nan=np.inf) < 12)
        returns.append(se2.transform_points(poses[scan.index], scan.points[near][::5]))
    merged = absorb_slivers(known, weights).segments
    assert len(merged) < put_in / 12
    assert (distance_to(merged, np.concatenate(returns)) < 0.1).mean() > 0.97
