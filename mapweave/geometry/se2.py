"""Rigid motions of the plane.

A pose or transform is ``[x, y, theta]``: metres and radians. As a transform it takes coordinates
in its own frame to coordinates in the parent's. Every function broadcasts over leading axes.
"""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from mapweave.geometry.arrays import FloatArray

IDENTITY: FloatArray = np.zeros(3)
IDENTITY.setflags(write=False)
LEVER = 1.0  # [m], how much a heading weighs against a position in a fit


def wrap(angle: ArrayLike) -> FloatArray:
    """Return `angle` [rad] in (-pi, pi]."""
    return np.asarray(np.pi - np.mod(np.pi - np.asarray(angle, dtype=float), 2 * np.pi))


def _pose(x: FloatArray, y: FloatArray, theta: FloatArray) -> FloatArray:
    """(..., 3) of its parts; faster than to stack them, which a tracker feels."""
    pose = np.empty((*theta.shape, 3))
    pose[..., 0], pose[..., 1], pose[..., 2] = x, y, theta
    return pose


def compose(first: ArrayLike, second: ArrayLike) -> FloatArray:
    """Return the pose of frame `second`, given in frame `first`, in the parent of `first`.

    Both are ``(..., 3)`` [m, m, rad]; so is the result, its angle in (-pi, pi].
    """
    a, b = np.asarray(first, dtype=float), np.asarray(second, dtype=float)
    if a.ndim == b.ndim == 1:
        return _compose_two(a.tolist(), b.tolist())
    c, s = np.cos(a[..., 2]), np.sin(a[..., 2])
    x = a[..., 0] + c * b[..., 0] - s * b[..., 1]
    y = a[..., 1] + s * b[..., 0] + c * b[..., 1]
    return _pose(x, y, wrap(a[..., 2] + b[..., 2]))


def inverse(pose: ArrayLike) -> FloatArray:
    """Return the ``(..., 3)`` inverse of `pose`."""
    p = np.asarray(pose, dtype=float)
    if p.ndim == 1:
        return _inverse_of_one(*p.tolist())
    c, s = np.cos(p[..., 2]), np.sin(p[..., 2])
    x, y = -c * p[..., 0] - s * p[..., 1], s * p[..., 0] - c * p[..., 1]
    return _pose(x, y, wrap(-p[..., 2]))


def _compose_two(first: Sequence[float], second: Sequence[float]) -> FloatArray:
    """`compose` of one pose and another, in plain floats: what a tracker does all the time."""
    (ax, ay, at), (bx, by, bt) = first, second
    c, s = math.cos(at), math.sin(at)
    return np.array([ax + c * bx - s * by, ay + s * bx + c * by, _wrapped(at + bt)])


def _inverse_of_one(x: float, y: float, theta: float) -> FloatArray:
    """`inverse` of one pose, in plain floats."""
    c, s = math.cos(theta), math.sin(theta)
    return np.array([-c * x - s * y, s * x - c * y, _wrapped(-theta)])


def _wrapped(angle: float) -> float:
    return math.pi - (math.pi - angle) % (2 * math.pi)


def between(origin: ArrayLike, target: ArrayLike) -> FloatArray:
    """Return the ``(..., 3)`` pose of `target` in the frame of `origin`; both share a parent."""
    return compose(inverse(origin), target)


def rotation(theta: float) -> FloatArray:
    """Return the ``(2, 2)`` rotation matrix of `theta` [rad]."""
    c, s = np.cos(theta), np.sin(theta)
    return np.array([[c, -s], [s, c]])


def transform_points(pose: ArrayLike, points: ArrayLike) -> FloatArray:
    """Return ``(..., 2)`` `points` [m], given in the frame at `pose` ``(3,)``, in its parent."""
    p = np.asarray(pose, dtype=float)
    return np.asarray(np.asarray(points, dtype=float) @ rotation(p[2]).T + p[:2])


def transform_segments(pose: ArrayLike, segments: ArrayLike) -> FloatArray:
    """Return ``(n, 4)`` `segments` [m], given in the frame at `pose` ``(3,)``, in its parent."""
    s = np.asarray(segments, dtype=float)
    return np.asarray(transform_points(pose, s.reshape(-1, 2)).reshape(s.shape))


def fit(poses: FloatArray, target: FloatArray) -> FloatArray:
    """Return the motion (3,) that takes `poses` (m, 3) closest to `target` (m, 3).

    Least squares over positions and, with the lever, headings: a path on one spot has only those.
    In the plane the best rotation is the direction of a sum of complex numbers.
    """
    p, q = poses[:, 0] + 1j * poses[:, 1], target[:, 0] + 1j * target[:, 1]
    turned = np.sum(np.conj(p - np.mean(p)) * (q - np.mean(q)))
    turned += LEVER**2 * np.sum(np.exp(1j * (target[:, 2] - poses[:, 2])))
    theta = np.angle(turned)
    shift = np.mean(q) - np.exp(1j * theta) * np.mean(p)
    return np.array([shift.real, shift.imag, theta])
