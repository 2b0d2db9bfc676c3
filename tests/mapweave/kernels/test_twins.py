"""The compiled kernels compute what their NumPy twins do."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapweave.geometry.arrays import FloatArray
from mapweave.kernels import correlative, segmentation
from mapweave.kernels.loading import COMPILED
from mapweave.kernels.point_map import (
    IcpSettings,
    NumpyPointMap,
    PointMap,
    icp_settings,
    make_point_map,
)
from mapweave.kernels.pose_evidence import (
    EvidenceSettings,
    evidence_settings,
    pose_evidence_numpy,
)
from mapweave.kernels.segmentation import SegmentationSettings
from mapweave.kernels.viewpoints import NumpyViewpoints

pytestmark = pytest.mark.skipif(COMPILED is None, reason="no compiled kernels here")
SETTINGS = IcpSettings(0.35, 0.04, 0.75, 2e-4, 0.1, 25, 4, 0.7)
seeds = st.integers(0, 2**32 - 1)


def oriented(
    rng: np.random.Generator, count: int, spread: float = 4.0
) -> tuple[FloatArray, FloatArray]:
    angle = rng.uniform(-np.pi, np.pi, count)
    return rng.uniform(-spread, spread, (count, 2)), np.column_stack([np.cos(angle), np.sin(angle)])


def both(thin: float = 0.0, blocks: int = 5) -> tuple[PointMap, PointMap]:
    twin = NumpyPointMap(0.4, 0.25, thin, blocks)
    return make_point_map(0.4, 0.25, thin, blocks), twin


@settings(max_examples=40, deadline=None)
@given(seeds, st.sampled_from([0.0, 0.05, 0.4]), st.integers(0, 9), st.integers(0, 40))
def test_maps_that_took_the_same_blocks_hold_and_find_the_same(
    seed: int, thin: float, count: int, size: int
) -> None:
    rng = np.random.default_rng(seed)
    compiled, twin = both(thin)
    poses = rng.uniform(-3, 3, (3, 3))
    beams, every = int(rng.choice([1, 50, 360])), int(rng.integers(1, 4))
    clear = rng.uniform(0, 9) + rng.uniform(0, rng.choice([0.1, 3.0]), beams)
    spacing = 2 * np.pi / 360 if beams == 360 else 0.06

    def shares(points: PointMap) -> FloatArray:
        return points.seen_through(clear, -1.5, spacing, poses, 0.3, 3.0, 6.0, 0.7, every)

    for _ in range(count):
        block = oriented(rng, size, rng.choice([1.0, 30.0]))
        tags = rng.integers(-1, 4, size)
        compiled.add(*block, tags)
        twin.add(*block, tags)
        np.testing.assert_allclose(shares(compiled), shares(twin))
    assert len(compiled) == len(twin)
    assert compiled.newest == twin.newest
    for one, other in zip(compiled.content(), twin.content(), strict=True):
        np.testing.assert_array_equal(one, other)
    asked = oriented(rng, 30)
    reach = float(rng.choice([0.3, 1.0, np.inf]))
    distance, number = compiled.find(*asked, reach)
    twin_distance, twin_number = twin.find(*asked, reach)
    np.testing.assert_allclose(distance, twin_distance, rtol=1e-12)
    np.testing.assert_array_equal(number, twin_number)
    np.testing.assert_array_equal(
        compiled.explains(*asked, poses, 0.5), twin.explains(*asked, poses, 0.5)
    )


@pytest.mark.skipif(COMPILED is None, reason="twins take any of them")
@settings(max_examples=40, deadline=None)
@given(seeds, st.integers(1, 60))
def test_of_points_that_are_as_near_the_first_one_is_found(seed: int, size: int) -> None:
    rng = np.random.default_rng(seed)
    known, ahead = both(blocks=3)[0], np.tile([0.0, 1.0], (size, 1))
    for _ in range(5):  # on a lattice, some on one spot; the first blocks are forgotten
        known.add(rng.integers(0, 5, (size, 2)) / 4, ahead)
    places, asked = known.content()[0], rng.integers(-1, 10, (size, 2)) / 8
    apart = np.hypot(*(asked[:, None] - places).T).T
    first, least = apart.argmin(axis=1), apart.min(axis=1)
    for reach in (0.125, 0.3, 2.0):
        number = known.find(asked, ahead, reach)[1]
        expected = np.where(least < reach, known.newest - len(places) + 1 + first, -1)
        np.testing.assert_array_equal(number, expected)


@settings(max_examples=25, deadline=None)
@given(seeds, st.booleans())
def test_alignments_end_at_the_same_poses(seed: int, tagged: bool) -> None:
    rng = np.random.default_rng(seed)
    compiled, twin = both()
    points, normals = oriented(rng, 80, 3.0)
    tags = rng.integers(-1, 3, 80)
    for each in (compiled, twin):
        each.add(points, normals, tags)
    starts = rng.normal(0, 1, (4, 3)) * [[0.05], [0.05], [0.4], [0.4]]
    prior = np.diag([4.0, 4.0, 8.0])
    more = (tags, rng.random((3, 3)) < 0.7) if tagged else (None, None)
    one = compiled.align(points, normals, starts, prior, icp_settings(SETTINGS), *more)
    other = twin.align(points, normals, starts, prior, SETTINGS, *more)
    np.testing.assert_array_equal(one[0], other[0])
    np.testing.assert_allclose(one[1], other[1], atol=1e-9)
    np.testing.assert_allclose(one[2], other[2], atol=1e-6, rtol=1e-9)


@settings(max_examples=25, deadline=None)
@given(seeds, st.integers(0, 12), st.sampled_from([0.01, 0.12, 2 * np.pi / 50]))
def test_viewpoints_saw_through_the_same(seed: int, count: int, spacing: float) -> None:
    rng = np.random.default_rng(seed)
    assert COMPILED is not None
    compiled, twin = COMPILED.Viewpoints(8), NumpyViewpoints(8)
    for _ in range(count):
        scan = rng.uniform(0, 8, 50), -1.4, spacing, rng.uniform(-3, 3, 3)
        compiled.add(*scan)
        twin.add(*scan)
    points, poses = rng.uniform(-5, 5, (40, 2)), rng.uniform(-3, 3, (4, 3))
    asked = rng.random((4, 40)) < 0.7
    found = compiled.free(points, poses, asked, 3, 0.3)
    np.testing.assert_array_equal(found, twin.free(points, poses, asked, 3, 0.3))
    assert not found[~asked].any()


@settings(max_examples=25, deadline=None)
@given(seeds, st.integers(0, 12), st.integers(0, 60))
def test_as_many_points_speak_for_and_against_a_pose(seed: int, count: int, size: int) -> None:
    rng = np.random.default_rng(seed)
    assert COMPILED is not None
    known, twin = both(0.05)
    viewpoints, twin_viewpoints = COMPILED.Viewpoints(8), NumpyViewpoints(8)
    for _ in range(count):
        block = oriented(rng, 20)
        scan = rng.uniform(0, 8, 50), -1.4, 0.12, rng.uniform(-3, 3, 3)
        for points, views in ((known, viewpoints), (twin, twin_viewpoints)):
            points.add(*block)
            views.add(*scan)
    loose = rng.random(size) < 0.3
    asked = (*oriented(rng, size, 6.0), loose, rng.uniform(-3, 3, (4, 3)))
    limits = EvidenceSettings(0.4, 0.3, 3, 2.0, 5.0, 0.7)
    found = COMPILED.pose_evidence(known, viewpoints, *asked, evidence_settings(limits))
    np.testing.assert_array_equal(found, pose_evidence_numpy(twin, twin_viewpoints, *asked, limits))


@settings(max_examples=25, deadline=None)
@given(seeds, st.integers(0, 60), st.booleans())
def test_windows_score_the_same(seed: int, count: int, regular: bool) -> None:
    rng = np.random.default_rng(seed)
    points, origin = rng.uniform(-4, 4, (count, 2)), np.array([-3.0, -3.0])
    field = correlative.nearness_field(points, origin, 0.1, 60, 0.15)
    twin = correlative.nearness_field_numpy(points, origin, 0.1, 60, 0.15)
    np.testing.assert_allclose(field, twin, atol=1e-6)
    shifts = np.arange(-0.9, 1, 0.3)[:, None] + rng.uniform(-1, 1, 2)
    window = rng.uniform(-3, 3, 40), shifts if regular else rng.uniform(-1, 1, (4, 2))
    one = correlative.window_scores(points, twin, origin, 0.1, *window)
    other = correlative.window_scores_numpy(points, twin, origin, 0.1, *window)
    np.testing.assert_allclose(one, other, atol=1e-4)


@pytest.mark.parametrize(
    "refused",
    [
        lambda m: m.add(np.zeros((2, 2)), np.zeros((3, 2))),
        lambda m: m.add(np.zeros((2, 3)), np.zeros((2, 3))),
        lambda m: m.add(np.full((1, 2), np.nan), np.zeros((1, 2))),
        lambda m: m.add(np.zeros((2, 2)), np.zeros((2, 2)), np.zeros(1, dtype=np.int64)),
        lambda m: m.explains(np.zeros((2, 2)), np.zeros((2, 2)), np.zeros((1, 2)), 1.0),
    ],
)
def test_lengths_that_do_not_agree_are_refused(refused: Callable[[PointMap], object]) -> None:
    for each in both():
        with pytest.raises(ValueError, match="expected"):
            refused(each)


@settings(max_examples=60, deadline=None)
@given(seeds, st.integers(0, 90), st.sampled_from([0.0, 0.02, 0.3]))
def test_scans_are_segmented_and_oriented_alike(seed: int, beams: int, noise: float) -> None:
    rng = np.random.default_rng(seed)
    angles = np.linspace(-1.5, 1.5, beams) if beams else np.empty(0)
    walls = np.minimum(4 / np.maximum(np.cos(angles), 0.1), 6 / np.maximum(np.sin(angles), 0.1))
    ranges = np.where(rng.random(beams) < 0.1, np.nan, walls + rng.normal(0, noise, beams))
    chosen = SegmentationSettings(30.0, 0.25, 0.12, 0.04, 0.004, 3, 0.1)
    one = segmentation.extract_segments(angles, ranges, chosen)
    other = segmentation.extract_segments_numpy(angles, ranges, chosen)
    np.testing.assert_allclose(one[0], other[0], atol=1e-9)
    np.testing.assert_array_equal(one[1], other[1])
    rest = *other, 25.0, 0.5, 0.2
    points = segmentation.orient(angles, ranges, *rest)
    twins = segmentation.orient_numpy(angles, ranges, *rest)
    for a, b in zip(points, twins, strict=True):
        for c, d in zip(a, b, strict=True):
            np.testing.assert_allclose(c, d, atol=1e-9)
