"""Evidence: samples that stand for the wall that was seen, and what lies near them."""

from dataclasses import fields

import numpy as np
import pytest
from numpy.random import Generator

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.geometry.segments import units
from mapweave.kernels.lines.sampling import sample_parts
from mapweave.lines.sightings import Nearness, Sightings
from tests.mapweave.buildings import random_pose


def some_segments(rng: Generator, count: int) -> FloatArray:
    start = rng.uniform(-5, 5, (count, 2))
    return np.hstack([start, start + rng.normal(0, 1.5, (count, 2))])


def test_the_weights_are_the_wall_seen_as_often_as_it_was_seen(rng: Generator) -> None:
    segments, counts = some_segments(rng, 40), rng.integers(1, 9, 40)
    _, lengths = units(segments)
    evidence = Sightings.of(segments, counts, 0.1)
    assert evidence.weights.sum() == pytest.approx((lengths * counts).sum())
    assert evidence.gathered().weights.sum() == pytest.approx((lengths * counts).sum())


def test_samples_lie_on_their_segment_in_equal_steps_its_ends_included(rng: Generator) -> None:
    segments = some_segments(rng, 20)
    points, directions, parts, owner = sample_parts(segments, 0.25)
    for number, segment in enumerate(segments):
        own = owner == number
        along = (points[own] - segment[:2]) @ directions[own][0]
        length = float(np.hypot(*(segment[2:] - segment[:2])))
        np.testing.assert_allclose(along, (np.arange(own.sum()) + 0.5) * length / own.sum())
        assert parts[own].max() <= 0.25
        np.testing.assert_allclose(parts[own].sum(), length)


def test_gathering_a_hundred_sightings_of_a_wall_takes_hardly_more_than_one(rng: Generator) -> None:
    wall = np.array([[0.0, 0.0, 10.0, 0.0]])
    seen = np.repeat(wall, 100, axis=0) + rng.normal(0, 0.01, (100, 4))
    evidence = Sightings.of(seen, np.ones(100, dtype=np.int64), 0.1)
    gathered = evidence.gathered()
    assert len(gathered) < 0.1 * len(evidence)
    np.testing.assert_allclose(
        gathered.weights @ gathered.points / gathered.weights.sum(),
        evidence.weights @ evidence.points / evidence.weights.sum(),
    )
    np.testing.assert_allclose(np.hypot(*gathered.directions.T), 1.0)


def test_opposite_faces_are_never_gathered_into_one() -> None:
    faces = np.array([[0.0, 0.0, 3.0, 0.0], [3.0, 0.0, 0.0, 0.0]])
    gathered = Sightings.of(faces, np.ones(2, dtype=np.int64), 0.1).gathered()
    assert set(np.sign(gathered.directions[:, 0])) == {-1.0, 1.0}
    np.testing.assert_allclose(np.abs(gathered.directions[:, 0]), 1.0)


def test_nearness_agrees_with_every_pair_looked_at_after_any_rigid_motion(rng: Generator) -> None:
    segments, reach = some_segments(rng, 30), 0.4
    points, directions = rng.uniform(-5, 5, (200, 2)), np.tile([1.0, 0.0], (200, 1))
    own, lengths = units(segments)
    offset = points[None] - segments[:, None, :2]
    along = (offset * own[:, None]).sum(axis=-1)
    beside = np.clip(along, 0, lengths[:, None])[..., None] * own[:, None]
    distance = np.linalg.norm(offset - beside, axis=-1)
    expected = {pair: distance[pair] for pair in zip(*np.nonzero(distance <= reach), strict=True)}
    for motion in (np.zeros(3), random_pose(rng)):
        turned = directions @ se2.rotation(motion[2]).T
        near = Nearness.of(
            se2.transform_segments(motion, segments),
            se2.transform_points(motion, points),
            turned,
            reach,
        )
        found = dict(zip(zip(near.segment, near.sample, strict=True), near.distance, strict=True))
        assert found.keys() == expected.keys()
        for pair, value in found.items():
            assert value == pytest.approx(expected[pair], abs=1e-9)
        np.testing.assert_allclose(near.cosine, own[near.segment, 0], atol=1e-9)
        np.testing.assert_allclose(near.along, along[near.segment, near.sample], atol=1e-9)


def test_what_is_near_some_of_many_segments_is_what_is_near_them_alone(rng: Generator) -> None:
    segments, points = some_segments(rng, 30), rng.uniform(-5, 5, (200, 2))
    directions = np.tile([1.0, 0.0], (200, 1))
    first, others = (Nearness.of(s, points, directions, 0.4) for s in np.split(segments, [12]))
    together = first.followed_by(others, 12)
    for chosen in (np.arange(30), rng.permutation(30)[:17], np.empty(0, dtype=np.int64)):
        near = together.of_segments(chosen)
        alone = Nearness.of(segments[chosen], points, directions, 0.4)
        for field in fields(Nearness):
            np.testing.assert_array_equal(getattr(near, field.name), getattr(alone, field.name))


def test_nothing_seen_is_no_evidence() -> None:
    nothing = Sightings.of(np.empty((0, 4)), np.empty(0, dtype=np.int64), 0.1)
    assert len(nothing) == len(nothing.gathered()) == 0
