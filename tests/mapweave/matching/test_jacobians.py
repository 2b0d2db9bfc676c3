"""The solvers' derivatives are those of the residuals, told by finite differences.

A residual is how far [m] a moved point lies across the surface of its partner. Each solver is asked
for one step with all pairs at full weight, and held against a Gauss-Newton step made here.
"""

from collections.abc import Callable

import numpy as np
import pytest

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray, IntArray
from mapweave.kernels.multiview import STAYS, normal_equations
from mapweave.matching.distance_field import DistanceField, DistanceFieldParameters
from mapweave.matching.field_icp import FieldIcpParameters, align_on_raster
from mapweave.matching.icp import IcpParameters, Target, align, partners
from mapweave.scan.points import OrientedPoints, points_on_lines
from tests.mapweave.buildings import BUILDING, line_map, part, random_pose, walls_of

SEEDS = range(5)
STEP = 1e-6  # [m, rad] of the differences
FAR = 1e6  # [m] scale at which every pair has full weight
ROOMS = points_on_lines(line_map(walls_of(BUILDING)), 0.1)[0]


def differences(residuals: Callable[[FloatArray], FloatArray], pose: FloatArray) -> FloatArray:
    """Return the (n, k) central differences of n residuals by the k parts of `pose`."""
    steps = STEP * np.eye(len(pose))
    columns = [(residuals(pose + step) - residuals(pose - step)) / (2 * STEP) for step in steps]
    return np.stack(columns, axis=-1)


def across(moving: OrientedPoints, fixed: OrientedPoints, index: IntArray) -> FloatArray:
    """Return (n,) how far [m] points lie across the surfaces of their partners, fixed[index]."""
    return np.asarray(((moving.points - fixed.points[index]) * fixed.normals[index]).sum(axis=1))


def some_motion(rng: np.random.Generator, metres: float, radians: float) -> FloatArray:
    return np.array([*rng.uniform(-metres, metres, 2), rng.uniform(-radians, radians)])


@pytest.mark.parametrize("seed", SEEDS)
def test_one_step_of_icp_is_a_gauss_newton_step(seed: int) -> None:
    rng = np.random.default_rng(seed)
    near = ROOMS.at(np.hypot(*(ROOMS.points - [13, 0]).T) < 7)
    frame = random_pose(rng)  # the target's
    start = se2.compose(frame, [13.0, 0.0, rng.uniform(-3, 3)])
    moving = near.moved(frame).moved(se2.inverse(se2.compose(start, some_motion(rng, 0.03, 0.003))))
    parameters = IcpParameters(start_scale=FAR, end_scale=FAR, max_iterations=1)
    fixed = ROOMS.moved(frame)
    target = Target.of(fixed, parameters)
    _, index = partners(moving.moved(start), target, np.inf)

    def residuals(pose: FloatArray) -> FloatArray:
        return across(moving.moved(pose), fixed, index)

    jacobian = differences(residuals, start)
    fit = align(moving, target, start, parameters)
    np.testing.assert_allclose(fit.information, jacobian.T @ jacobian, rtol=1e-5, atol=1e-4)
    step = np.linalg.lstsq(jacobian, -residuals(start), rcond=None)[0]
    moved = fit.pose - start
    moved[2] = se2.wrap(moved[2])
    np.testing.assert_allclose(moved, step, atol=1e-6)


@pytest.mark.parametrize("seed", SEEDS)
def test_one_step_by_look_up_is_a_gauss_newton_step(seed: int) -> None:
    """About the middle of what moves; the damping is made too little to matter."""
    rng = np.random.default_rng(seed)
    frame = random_pose(rng)
    reference = DistanceField.of(part(BUILDING, 0, 30), DistanceFieldParameters())
    other = DistanceField.of(
        part(BUILDING, 5, 25).moved(se2.inverse(frame)), DistanceFieldParameters()
    )
    moving, middle = other.oriented, other.oriented.points.mean(axis=0)
    parameters = FieldIcpParameters(
        start_scale=FAR, iterations=1, damping=1e-12, max_samples=len(moving), min_cosine=0.0
    )
    offset = np.array([*middle, 0.0])
    there = se2.compose(se2.compose(frame, offset), some_motion(rng, 0.05, 0.005))
    centred = OrientedPoints(moving.points - middle, moving.normals, moving.polyline)
    index, _, _ = reference.look_up(centred.moved(there).points)
    facing = (centred.moved(there).normals * reference.oriented.normals[index]).sum(axis=1) > 0

    def residuals(pose: FloatArray) -> FloatArray:
        off = across(centred.moved(pose), reference.oriented, index.astype(np.int64))
        return np.asarray(off[facing])

    start = se2.compose(there, se2.inverse(offset))
    found = align_on_raster(reference, other, start[None], parameters)[0]
    moved = se2.compose(found, offset) - there
    moved[2] = se2.wrap(moved[2])
    jacobian = differences(residuals, there)
    step = np.linalg.lstsq(jacobian, -residuals(there), rcond=None)[0]
    np.testing.assert_allclose(moved, step, atol=1e-6)


@pytest.mark.parametrize("seed", SEEDS)
def test_normal_equations_of_many_scans_are_those_of_the_differences(seed: int) -> None:
    """Each point has its nearest as its partner, in another scan or in what stays."""
    rng = np.random.default_rng(seed)
    scans, each = 3, 8
    owner = np.repeat(np.arange(scans), each)
    points, angle = rng.uniform(-3, 3, (scans * each, 2)), rng.uniform(-np.pi, np.pi, scans * each)
    normals = np.column_stack([np.cos(angle), np.sin(angle)])
    walls, faces = rng.uniform(-3, 3, (9, 2)), np.tile([0.6, 0.8], (9, 1))
    poses = rng.normal(0, 0.3, (scans, 3))

    def placed(flat: FloatArray) -> tuple[FloatArray, FloatArray]:
        at = flat.reshape(-1, 3)[owner]
        there = [se2.transform_points(pose, p) for pose, p in zip(at, points, strict=True)]
        turned = [se2.rotation(pose[2]) @ n for pose, n in zip(at, normals, strict=True)]
        return np.vstack([*there, walls]), np.vstack([*turned, faces])

    everything = np.hstack(placed(poses.ravel())) * [1, 1, 0.4, 0.4]
    apart = np.linalg.norm(everything[: len(points), None] - everything, axis=-1)
    np.fill_diagonal(apart, np.inf)
    nearest = apart.argmin(axis=1)
    whose = np.append(owner, np.full(len(walls), STAYS))
    pairs = np.flatnonzero(whose[nearest] != owner)
    assert len(pairs) > scans

    def residuals(flat: FloatArray) -> FloatArray:
        there, turned = placed(flat)
        partner = nearest[pairs]
        return np.asarray(((there[pairs] - there[partner]) * turned[partner]).sum(axis=1))

    jacobian = differences(residuals, poses.ravel())
    matrix, pull = normal_equations(
        points, normals, owner, poses, walls, faces, 0.4, partners=1, scale=FAR
    )
    np.testing.assert_allclose(matrix, jacobian.T @ jacobian, atol=1e-5)
    np.testing.assert_allclose(pull, jacobian.T @ residuals(poses.ravel()), atol=1e-5)
