"""Equal stretches of two maps by turn-angle codes (paper, VIII: H1, H2, V1)."""

import itertools
from math import pi

import numpy as np
import pytest
from pydantic import ValidationError

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray, IntArray
from mapweave.shape.tangent_space import complexity, similarity
from mapweave.shape.windows import (
    Candidates,
    WindowParameters,
    Windows,
    all_windows,
    match,
    match_all,
    windows,
)

SEEDS = range(6)
EVERYTHING = WindowParameters(
    min_complexity=0, min_similarity=0, min_gain=-1, max_residual=1e9, max_candidates=10**6
)


def random_map(seed: int, polylines: int = 12, size: float = 15.0) -> tuple[FloatArray, IntArray]:
    """Return a map of random generalized polylines, with gaps of a few centimetres."""
    rng = np.random.default_rng(seed)
    count = rng.integers(3, 9, polylines)
    parts = []
    for n in count:
        direction = np.cumsum(rng.uniform(-2, 2, n))
        along = np.column_stack([np.cos(direction), np.sin(direction)])
        step = rng.uniform(0.4, 2.5, n)[:, None] * along
        start = rng.uniform(0, size, 2) + np.cumsum(step, axis=0) - step
        start += rng.normal(0, 0.03, (n, 2))
        parts.append(np.hstack([start, start + step]))
    return np.vstack(parts), np.repeat(np.arange(polylines), count)


def corner_map() -> tuple[FloatArray, IntArray]:
    return np.array([[0.0, 0, 4, 0], [4.0, 0, 4, 4]]), np.zeros(2, dtype=np.int64)


def is_near(found: Candidates, truth: FloatArray, distance: float, angle: float) -> FloatArray:
    apart = np.hypot(*(found.transform[:, :2] - truth[:2]).T)
    turned = np.abs(se2.wrap(found.transform[:, 2] - truth[2]))
    return np.asarray((apart < distance) & (turned < angle))


def in_order_of_windows(found: Candidates) -> Candidates:
    return found.take(np.lexsort([found.window_b, found.window_a]))


@pytest.mark.parametrize("seed", SEEDS)
def test_true_motion_is_among_the_first_candidates(seed: int) -> None:
    segments, polyline = random_map(seed)
    truth = np.random.default_rng(seed).uniform(-3, 3, 3)
    moved = se2.transform_segments(se2.inverse(truth), segments)
    parameters = WindowParameters()
    found = match_all(
        all_windows(segments, polyline, parameters),
        all_windows(moved, polyline, parameters),
        parameters,
    )
    assert is_near(found, truth, 1e-6, 1e-6)[0]


@pytest.mark.parametrize("seed", SEEDS)
def test_parts_match_parts(seed: int) -> None:
    """Polylines that begin and end elsewhere, noisy and out of phase, still give the motion."""
    segments, polyline = random_map(seed)
    truth = np.random.default_rng(seed).uniform(-3, 3, 3)
    part = segments.copy()
    first = np.insert(np.diff(polyline) != 0, 0, True)
    part[first, :2] += 0.37 * (part[first, 2:] - part[first, :2])
    kept = ~np.append(np.diff(polyline) != 0, True)
    part = part[kept] + np.random.default_rng(seed).normal(0, 0.01, part[kept].shape)
    seen = se2.transform_segments(se2.inverse(truth), part)
    parameters = WindowParameters()
    found = match_all(
        all_windows(segments, polyline, parameters),
        all_windows(seen, polyline[kept], parameters),
        parameters,
    )
    assert is_near(found, truth, 0.3, 0.1)[:20].any()


@pytest.mark.parametrize("seed", SEEDS)
def test_similarity_and_rotation_of_every_pair_are_the_best_over_all_rotations(seed: int) -> None:
    """Brute force over the rotation: mean cosine of the angles that are left."""
    a, b = (windows(*random_map(s, 3), 2.0, 16, 0.4) for s in (seed, seed + 100))
    found = match(a, b, EVERYTHING)
    assert len(found) > 10
    rotation = np.radians(np.arange(0, 360, 0.5))
    difference = np.angle(a.codes[found.window_a] * b.codes[found.window_b].conj())
    alike = np.cos(difference[:, :, None] - rotation).mean(axis=1)
    np.testing.assert_allclose(found.similarity, alike.max(axis=1), atol=1e-4)
    clear = found.similarity > 0.1
    best = rotation[alike.argmax(axis=1)]
    assert (np.abs(se2.wrap(best - found.transform[:, 2]))[clear] < 0.01).all()


def test_residual_is_the_rms_distance_of_corresponding_points_after_the_transform() -> None:
    a, b = (windows(*random_map(seed, 4), 2.0, 16, 0.4) for seed in (1, 2))
    found = match(a, b, EVERYTHING)
    for k in range(0, len(found), 7):
        moved = se2.transform_points(found.transform[k], b.points[found.window_b[k]])
        apart = moved - a.points[found.window_a[k]]
        assert np.sqrt((apart**2).sum(axis=1).mean()) == pytest.approx(found.residual[k])
        np.testing.assert_allclose(apart.mean(axis=0), 0, atol=1e-9)


@pytest.mark.parametrize("seed", SEEDS)
def test_rigid_motion_of_the_maps_changes_only_the_transforms(seed: int) -> None:
    segments, polyline = random_map(seed, 4)
    others, grouped = random_map(seed + 20, 4)
    move_a, move_b = np.random.default_rng(seed).uniform(-3, 3, (2, 3))
    before = match(
        windows(segments, polyline, 2.0, 16, 0.3),
        windows(others, grouped, 2.0, 16, 0.3),
        EVERYTHING,
    )
    after = match(
        windows(se2.transform_segments(move_a, segments), polyline, 2.0, 16, 0.3),
        windows(se2.transform_segments(move_b, others), grouped, 2.0, 16, 0.3),
        EVERYTHING,
    )
    before, after = in_order_of_windows(before), in_order_of_windows(after)
    np.testing.assert_allclose(after.score, before.score, atol=1e-6)
    expected = se2.compose(se2.compose(move_a, before.transform), se2.inverse(move_b))
    clear = before.similarity > 0.1
    np.testing.assert_allclose(after.transform[clear, :2], expected[clear, :2], atol=1e-6)
    np.testing.assert_allclose(
        se2.wrap(after.transform[clear, 2] - expected[clear, 2]), 0, atol=1e-6
    )


def test_a_pair_is_left_out_exactly_when_a_neighbouring_pair_explains_more() -> None:
    """Compared with a plain double loop over all windows and their eight neighbours."""
    a, b = (windows(*random_map(seed, 4), 1.5, 12, 0.3) for seed in (5, 6))
    gain = {
        (i, j): abs(np.vdot(b.codes[j], a.codes[i])) / 12
        - max(abs(a.codes[i].mean()), abs(b.codes[j].mean()))
        for i in range(len(a.codes))
        for j in range(len(b.codes))
    }

    def stands(i: int, j: int) -> bool:
        """Return whether a pair beats its neighbours; of equals the first does."""
        return not any(
            gain[k, m] > gain[i, j] + (1e-9 if (k, m) > (i, j) else -1e-9)
            for k, m in itertools.product((i - 1, i, i + 1), (j - 1, j, j + 1))
            if (k, m) in gain
            and (k, m) != (i, j)
            and a.polyline[k] == a.polyline[i]
            and b.polyline[m] == b.polyline[j]
        )

    found = match(a, b, EVERYTHING)
    pairs = set(zip(found.window_a.tolist(), found.window_b.tolist(), strict=True))
    assert pairs == {pair for pair in gain if stands(*pair)}


def test_only_salient_similar_close_pairs_become_candidates_best_first() -> None:
    parameters = WindowParameters(
        min_complexity=0.2,
        min_similarity=0.85,
        min_gain=0.05,
        max_residual=0.3,
        max_candidates=40,
    )
    a, b = (windows(*random_map(seed), 1.5, 12, 0.15) for seed in (7, 8))
    found = match(a, b, parameters)
    assert 0 < len(found) <= 40
    assert (a.complexity[found.window_a] >= 0.2).all()
    assert (b.complexity[found.window_b] >= 0.2).all()
    assert (found.similarity >= 0.85).all()
    straightness = np.maximum(a.straightness[found.window_a], b.straightness[found.window_b])
    assert (found.similarity - straightness > 0.05).all()
    assert (found.residual <= 0.3).all()
    assert (np.diff(found.score) <= 0).all()


def test_each_limit_leaves_out_what_is_beyond_it_and_nothing_else() -> None:
    """Of all pairs that no neighbour beats, those within the limit, one limit at a time."""
    a, b = (windows(*random_map(seed), 1.5, 12, 0.15) for seed in (7, 8))
    every = match(a, b, EVERYTHING)
    close = match(a, b, EVERYTHING.model_copy(update={"max_residual": 0.3}))
    assert 0 < (every.residual <= 0.3).sum() == len(close) < len(every)
    assert (close.residual <= 0.3).all()
    salient = match(a, b, EVERYTHING.model_copy(update={"min_complexity": 0.2}))
    assert 0 < len(salient) < len(every)
    assert (a.complexity[salient.window_a] >= 0.2).all()
    assert (b.complexity[salient.window_b] >= 0.2).all()


def test_the_most_salient_windows_are_compared_when_there_are_too_many() -> None:
    segments, polyline = random_map(9)
    cut = windows(segments, polyline, 2.0, 16, 0.2)
    found = match(cut, cut, EVERYTHING.model_copy(update={"max_windows": 5}))
    most_salient = set(np.argsort(-cut.complexity)[:5].tolist())
    assert set(found.window_a.tolist()) <= most_salient


def test_score_is_the_arc_length_explained_beyond_a_straight_line() -> None:
    """A right angle with equal legs against itself: straightness is |1 + i| / 2."""
    cut = windows(*corner_map(), 2.0, 20, 0.25)
    found = match(cut, cut, WindowParameters())
    assert found.similarity[0] == pytest.approx(1)
    assert found.score[0] == pytest.approx(2.0 * (1 - np.sqrt(0.5)))
    assert cut.arc[found.window_a[0]] == pytest.approx(3.0)


def test_different_gaps_show_in_the_residual_alone() -> None:
    """Equal turn angles, but the second wall stands 0.8 m further off."""
    segments, polyline = corner_map()
    apart = segments + np.array([[0.0, 0, 0, 0], [0, 0.8, 0, 0.8]])
    ours, theirs = (windows(s, polyline, 2.0, 20, 0.25) for s in (segments, apart))
    found = match(ours, theirs, EVERYTHING)
    assert found.similarity[0] == pytest.approx(1)
    centred = found.residual[(found.window_a == 12) & (found.window_b == 12)]
    assert centred == pytest.approx(0.4)


def test_of_windows_that_turn_alike_the_one_whose_points_lie_apart_explains_less() -> None:
    """The same corner twice, once with a gap of 0.8 m: 0.4 m rms of the 3 m that outweigh all."""
    segments, one = corner_map()
    gaping = segments + np.array([[50.0, 0, 50, 0], [50.0, 0.8, 50, 0.8]])
    both, two = np.vstack([gaping, segments]), np.array([0, 0, 1, 1])
    ours, theirs = windows(segments, one, 2.0, 20, 0.25), windows(both, two, 2.0, 20, 0.25)
    found = match(ours, theirs, WindowParameters())
    centred = found.take((found.window_a == 12) & (found.similarity > 1 - 1e-9))
    assert theirs.polyline[centred.window_b].tolist() == [1, 0]  # the best first
    assert centred.score[0] - centred.score[1] == pytest.approx(2.0 * 0.4 / 3.0)


@pytest.mark.parametrize("seed", SEEDS)
def test_windows_are_stretches_of_one_polyline_at_equal_arc_lengths(seed: int) -> None:
    """Every sample lies on the polyline where walking its segments, gaps excluded, leads."""
    segments, polyline = random_map(seed)
    cut = windows(segments, polyline, 2.0, 8, 0.3)
    for k in range(0, len(cut.arc), 5):
        own = segments[polyline == cut.polyline[k]]
        for sample in range(8):
            left = cut.arc[k] + 2.0 * (sample + 0.5) / 8
            for x1, y1, x2, y2 in own:
                length = np.hypot(x2 - x1, y2 - y1)
                if left < length:
                    break
                left -= length
            along = complex(x2 - x1, y2 - y1) / length
            point = complex(x1, y1) + left * along
            assert cut.codes[k, sample] == pytest.approx(along)
            np.testing.assert_allclose(cut.points[k, sample], [point.real, point.imag], atol=1e-9)


@pytest.mark.parametrize("seed", SEEDS)
def test_windows_slide_from_the_start_of_every_polyline_as_far_as_they_fit(seed: int) -> None:
    segments, polyline = random_map(seed)
    cut = windows(segments, polyline, 2.0, 8, 0.3)
    for group in range(polyline[-1] + 1):
        own = segments[polyline == group]
        total = np.hypot(*(own[:, 2:] - own[:, :2]).T).sum()
        expected = np.arange(0, total - 2.0, 0.3) if total >= 2.0 else np.empty(0)
        np.testing.assert_allclose(cut.arc[cut.polyline == group], expected)


def test_a_polyline_as_long_as_a_window_has_one() -> None:
    cut = windows(np.array([[0.0, 0, 0.1 + 0.2, 0]]), np.zeros(1, dtype=np.int64), 0.3, 3, 0.1)
    np.testing.assert_allclose(cut.points[0], [[0.05, 0], [0.15, 0], [0.25, 0]])


def test_codes_agree_with_the_paper_for_gentle_shapes() -> None:
    """Where turn angles are small, 2 (1 - similarity) = s(C, D) and complexity = sc(P)."""
    rng = np.random.default_rng(3)
    bends = rng.normal(0, 0.15, 6)
    polylines = []
    for direction in (2.0 + bends, bends + rng.normal(0, 0.03, 6)):
        step = np.column_stack([np.cos(direction), np.sin(direction)]) * 0.5
        end = np.cumsum(step, axis=0)
        polylines.append(np.hstack([end - step, end]))
    c, d = (windows(p, np.zeros(6, dtype=np.int64), 3.0, 300, 1.0) for p in polylines)
    found = match(c, d, EVERYTHING)
    s, theta = similarity(*polylines)
    assert 2 * (1 - found.similarity[0]) == pytest.approx(s, rel=0.02)
    assert found.transform[0, 2] == pytest.approx(-theta, abs=1e-3)
    assert c.complexity[0] == pytest.approx(complexity(polylines[0]), rel=0.02)


@pytest.mark.parametrize(
    "segments",
    [np.empty((0, 4)), np.array([[0.0, 0, 0.1, 0]]), np.array([[0.0, 0, 9, 0]])],
    ids=["empty", "short", "straight"],
)
def test_a_map_without_salient_windows_has_no_candidates(segments: FloatArray) -> None:
    parameters = WindowParameters()
    bare = all_windows(segments, np.zeros(len(segments), dtype=np.int64), parameters)
    rich = all_windows(*random_map(1), parameters)
    for a, b in ((bare, rich), (rich, bare), (bare, bare)):
        assert len(match_all(a, b, parameters)) == 0


def test_segments_without_length_leave_windows_unchanged() -> None:
    segments, polyline = corner_map()
    with_point = np.insert(segments, 1, [4, 0, 4, 0], axis=0)
    plain = windows(segments, polyline, 2.0, 20, 0.25)
    pointed = windows(with_point, np.zeros(3, dtype=np.int64), 2.0, 20, 0.25)
    assert_equal_windows(plain, pointed)


def assert_equal_windows(a: Windows, b: Windows) -> None:
    np.testing.assert_allclose(a.codes, b.codes)
    np.testing.assert_allclose(a.points, b.points)
    np.testing.assert_array_equal(a.polyline, b.polyline)


def test_window_lengths_must_be_positive_and_parameters_known() -> None:
    with pytest.raises(ValidationError):
        WindowParameters(lengths=(2.0, 0.0))
    with pytest.raises(ValidationError):
        WindowParameters(lengths=())
    with pytest.raises(ValidationError):
        WindowParameters.model_validate({"strides": 1})


def test_rotation_angle_stays_within_half_a_turn() -> None:
    a = windows(*random_map(3), 2.0, 16, 0.3)
    found = match(a, a, EVERYTHING)
    assert (np.abs(found.transform[:, 2]) <= pi).all()
