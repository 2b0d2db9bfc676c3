"""Oriented points that grow block by block: nearest neighbours, and ICP on them.

Nearness is of place and normal at once: the distance in (x, y, weight * nx, weight * ny). A point
that is like one of an earlier block only renews it, so that a wall seen from sixty places is not
sixty walls; what the last blocks did not see is forgotten.
"""

from typing import NamedTuple, Protocol, cast

import numpy as np
import scipy
from numpy.typing import NDArray

from mapweave.kernels.loading import COMPILED

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

_WEAKEST = np.diag([1e-6, 1e-6, 1e-6])  # [1/m², 1/rad²] so that a start without pairs stays


class IcpSettings(NamedTuple):
    """How ICP goes on: scales [m], `converged` the smallest step worth another [m, rad].

    After `trial` iterations starts with less than `share` of the best one's support, the summed
    weight of its pairs, are dropped.
    """

    start_scale: float
    end_scale: float
    shrink: float
    converged: float
    noise: float
    max_iterations: int
    trial: int
    share: float


class PointMap(Protocol):
    """What both the compiled class and its twin offer.

    Points are (n, 2) [m] with (n, 2) unit normals; poses (k, 3) [m, m, rad] take them into the
    map's frame; lengths that do not agree raise ValueError.
    """

    def __len__(self) -> int:
        """Return how many points there are."""

    def add(self, points: Floats, normals: Floats, tags: Ints | None = None) -> None:
        """Add a block, map's frame; `tags` (n,) name each point's polyline, -1 for none."""

    def find(self, points: Floats, normals: Floats, reach: float) -> tuple[Floats, Ints]:
        """Return (n,) distances [m] to the nearest points within `reach`, and their numbers.

        Infinite and -1 without one. Points are numbered in the order in which they came.
        """

    def explains(self, points: Floats, normals: Floats, poses: Floats, reach: float) -> Bools:
        """Return (k, n) whether there is a point within `reach` [m] of each, at each pose."""

    def align(
        self,
        points: Floats,
        normals: Floats,
        starts: Floats,
        prior: Floats,
        settings: IcpSettings,
        tags: Ints | None = None,
        corresponding: Bools | None = None,
    ) -> tuple[Ints, Floats, Floats]:
        """Return which (k,) starts were kept, where the points come to lie, what holds them.

        Poses (k, 3) and (k, 3, 3) information.

        See `mapweave.matching.icp.align_all`.
        """

    @property
    def newest(self) -> int:
        """The number of the point that was added last; -1 before the first."""

    def content(self) -> tuple[Floats, Floats]:
        """Return (n, 2) points and (n, 2) normals, in the order of their numbers."""

    def seen_through(
        self,
        clear: Floats,
        first: float,
        spacing: float,
        poses: Floats,
        clearance: float,
        sight: float,
        far_sight: float,
        facing: float,
        every: int = 1,
    ) -> Floats:
        """Return (k,) the share of the points in sight that a scan at each pose saw through.

        Parameters
        ----------
        clear
            (beams,) how far each beam saw nothing [m].
        first, spacing
            [rad] of the first beam, and between beams.
        clearance
            [m] how much nearer than what the beam hit a point must be.
        sight
            [m] up to which points are in sight.
        far_sight, facing
            [m] the same for points whose normal is turned towards the sensor, by this cosine.
        every
            Only points whose number is a multiple of it count.
        """

    def copy(self) -> "PointMap":
        """Return one that grows by itself from here."""


class NumpyPointMap:
    """The twin of the compiled class: a tree over all points, made anew when they change."""

    def __init__(self, normal_weight: float, cell: float, thin: float, blocks: int) -> None:
        if not (normal_weight > 0 and cell > 0 and thin >= 0 and blocks >= 1):
            raise ValueError("normal_weight, cell > 0, thin >= 0, blocks >= 1 expected")
        self._weight, self._thin, self._blocks = normal_weight, thin, blocks
        self._cell = cell
        self._points: Floats = np.empty((0, 2))
        self._normals: Floats = np.empty((0, 2))
        self._number = self._seen = self._tag = np.empty(0, dtype=np.int64)
        self._block = self._next = 0
        self._tree: scipy.spatial.KDTree | None = None

    def __len__(self) -> int:
        """See `PointMap`."""
        return len(self._points)

    def add(self, points: Floats, normals: Floats, tags: Ints | None = None) -> None:
        """See `PointMap`."""
        _check(points, normals)
        tag = np.full(len(points), -1, dtype=np.int64) if tags is None else tags
        if len(tag) != len(points):
            raise ValueError("tags: one a point expected")
        if not np.isfinite(points).all():
            raise ValueError("points: finite numbers expected")
        fresh = np.ones(len(points), dtype=np.bool_)
        if self._thin > 0 and len(self):
            distance, index = self._nearest(points, normals, self._thin)
            fresh = np.isinf(distance)
            self._seen[index[~fresh]] = self._block
        numbers = self._next + np.arange(fresh.sum())
        self._points = np.concatenate([self._points, points[fresh]])
        self._normals = np.concatenate([self._normals, normals[fresh]])
        self._number = np.concatenate([self._number, numbers])
        self._seen = np.concatenate([self._seen, np.full(len(numbers), self._block)])
        self._tag = np.concatenate([self._tag, tag[fresh]])
        self._next += len(numbers)
        self._block += 1
        kept = self._seen >= self._block - self._blocks
        if not kept.all():
            self._points, self._normals = self._points[kept], self._normals[kept]
            self._number, self._seen = self._number[kept], self._seen[kept]
            self._tag = self._tag[kept]
        self._tree = None

    def find(self, points: Floats, normals: Floats, reach: float) -> tuple[Floats, Ints]:
        """See `PointMap`."""
        _check(points, normals)
        distance, index = self._nearest(points, normals, reach)
        return distance, np.append(self._number, -1)[index]

    def explains(self, points: Floats, normals: Floats, poses: Floats, reach: float) -> Bools:
        """See `PointMap`."""
        _check(points, normals)
        placed = [_placed(points, normals, pose) for pose in _poses(poses)]
        found = [np.isfinite(self._nearest(p, n, reach)[0]) for p, n in placed]
        return np.array(found, dtype=np.bool_).reshape(len(poses), len(points))

    def align(
        self,
        points: Floats,
        normals: Floats,
        starts: Floats,
        prior: Floats,
        settings: IcpSettings,
        tags: Ints | None = None,
        corresponding: Bools | None = None,
    ) -> tuple[Ints, Floats, Floats]:
        """See `PointMap`."""
        _check(points, normals)
        held, p = prior + _WEAKEST, settings
        pull = (points, normals, tags, corresponding)
        attempts = [_Attempt(start, p.start_scale) for start in _poses(starts)]
        for attempt in attempts:
            self._go_on(attempt, min(p.trial, p.max_iterations), held, p, *pull)
        most = max((attempt.support for attempt in attempts), default=0.0)
        kept = [k for k, attempt in enumerate(attempts) if attempt.support >= p.share * most]
        for k in kept:
            self._go_on(attempts[k], p.max_iterations, held, p, *pull)
            attempts[k].pose[2] = _wrap(attempts[k].pose[2])
        poses = np.array([attempts[k].pose for k in kept]).reshape(-1, 3)
        information = np.array([attempts[k].information for k in kept]).reshape(-1, 3, 3)
        return np.array(kept, dtype=np.int64), poses, information

    @property
    def newest(self) -> int:
        """See `PointMap`."""
        return self._next - 1

    def content(self) -> tuple[Floats, Floats]:
        """See `PointMap`."""
        return self._points, self._normals

    def seen_through(
        self,
        clear: Floats,
        first: float,
        spacing: float,
        poses: Floats,
        clearance: float,
        sight: float,
        far_sight: float,
        facing: float,
        every: int = 1,
    ) -> Floats:
        """See `PointMap`."""
        shares = np.zeros(len(_poses(poses)))
        counted = self._number % every == 0
        for k, pose in enumerate(poses):
            offset = self._points[counted] - pose[:2]
            squared = (offset**2).sum(axis=1)
            ahead = -(offset * self._normals[counted]).sum(axis=1)
            faced = (ahead > 0) & (ahead**2 > facing**2 * squared) & (squared < far_sight**2)
            seen = (squared < sight**2) | faced
            if seen.any():
                shares[k] = before_beams(
                    offset[seen], float(pose[2]), clear, first, spacing, clearance
                ).mean()
        return shares

    def copy(self) -> "NumpyPointMap":
        """See `PointMap`."""
        other = NumpyPointMap(self._weight, self._cell, self._thin, self._blocks)
        other.__dict__.update(self.__dict__)
        other._seen = self._seen.copy()
        return other

    def _nearest(self, points: Floats, normals: Floats, reach: float) -> tuple[Floats, Ints]:
        if not len(self):
            return np.full(len(points), np.inf), np.zeros(len(points), dtype=np.int64)
        if self._tree is None:
            self._tree = scipy.spatial.KDTree(
                np.hstack([self._points, self._weight * self._normals])
            )
        asked = np.hstack([points, self._weight * normals])
        distance, index = self._tree.query(asked, distance_upper_bound=reach)
        return np.asarray(distance, dtype=np.float64), np.asarray(index, dtype=np.int64)

    def _go_on(
        self,
        attempt: "_Attempt",
        until: int,
        held: Floats,
        p: IcpSettings,
        points: Floats,
        normals: Floats,
        tags: Ints | None,
        corresponding: Bools | None,
    ) -> None:
        """Iterate Gauss and Newton's steps, held by the prior, until none is worth it."""
        while not attempt.settled and attempt.iterations < until:
            pose, start = attempt.pose, attempt.start
            attempt.information, gradient, attempt.support = self._linearise(
                points, normals, pose, attempt.scale, tags, corresponding
            )
            error = np.append(pose[:2] - start[:2], _wrap(pose[2] - start[2]))
            system = attempt.information / p.noise**2 + held
            step = np.linalg.solve(system, gradient / p.noise**2 + error @ held)
            attempt.pose = pose - step
            small = np.abs(step).max() < p.converged
            attempt.settled = bool(attempt.scale <= p.end_scale and small)
            attempt.scale = max(p.end_scale, attempt.scale * p.shrink)
            attempt.iterations += 1

    def _linearise(
        self,
        points: Floats,
        normals: Floats,
        pose: Floats,
        scale: float,
        tags: Ints | None,
        corresponding: Bools | None,
    ) -> tuple[Floats, Floats, float]:
        """(3, 3) normal matrix, (3,) gradient of the robust point-to-line cost, summed weight."""
        placed, turned = _placed(points, normals, pose)
        distance, index = self._nearest(placed, turned, 3 * scale)
        paired = np.isfinite(distance)
        if tags is not None and corresponding is not None:
            theirs = np.append(self._tag, -1)[index]
            paired &= (theirs >= 0) & (tags >= 0)
            paired[paired] = corresponding[theirs[paired], tags[paired]]
        partner = index[paired]
        weight = 1 / (1 + (distance[paired] / scale) ** 2) ** 2  # Geman-McClure
        there = self._normals[partner]
        residual = (there * (placed[paired] - self._points[partner])).sum(axis=1)
        arm = placed[paired] - pose[:2]
        turning = there[:, 1] * arm[:, 0] - there[:, 0] * arm[:, 1]
        jacobian = np.column_stack([there, turning])
        normal_matrix = (weight[:, None] * jacobian).T @ jacobian
        return normal_matrix, jacobian.T @ (weight * residual), float(weight.sum())


class _Attempt:
    """A start on its way."""

    def __init__(self, start: Floats, scale: float) -> None:
        self.start, self.scale = start, scale
        self.pose = np.array(start, dtype=np.float64)
        self.information: Floats = np.zeros((3, 3))
        self.support, self.iterations, self.settled = 0.0, 0, False


def before_beams(
    offset: Floats, heading: float, clear: Floats, first: float, spacing: float, clearance: float
) -> Bools:
    """Return (n,) which points lie nearer than what the beams about them saw through.

    Parameters
    ----------
    offset
        (n, 2) from the sensor [m], map's axes.
    heading
        [rad] of the sensor.
    """
    c, s = np.cos(heading), np.sin(heading)
    x, y = c * offset[:, 0] + s * offset[:, 1], c * offset[:, 1] - s * offset[:, 0]
    count, turn = len(clear), 2 * np.pi
    steps = np.mod(np.arctan2(y, x) - first, turn) / spacing
    closed = count * spacing > turn - spacing / 2  # the last beam and the first are neighbours
    beam = np.rint(steps).astype(np.int64)
    beam[beam >= count] = 0
    near = np.hypot(x, y) < clear[beam] - clearance
    return np.asarray(near & ((steps <= count - 1) | closed), dtype=np.bool_)


def _placed(points: Floats, normals: Floats, pose: Floats) -> tuple[Floats, Floats]:
    c, s = np.cos(pose[2]), np.sin(pose[2])
    turn = np.array([[c, s], [-s, c]])
    return points @ turn + pose[:2], normals @ turn


def _wrap(angle: float) -> float:
    return float(angle - 2 * np.pi * np.ceil((angle - np.pi) / (2 * np.pi)))


def _check(points: Floats, normals: Floats) -> None:
    if points.shape != normals.shape or points.ndim != 2 or points.shape[1] != 2:
        raise ValueError("points and normals: (n, 2) each expected")


def _poses(poses: Floats) -> Floats:
    if poses.ndim != 2 or poses.shape[1] != 3:
        raise ValueError("poses: (k, 3) expected")
    return poses


def make_point_map(normal_weight: float, cell: float, thin: float, blocks: int) -> PointMap:
    """Return an empty map.

    Parameters
    ----------
    normal_weight
        [m] half of how far opposite normals hold two points apart.
    cell
        [m] of the grid that the points are looked up in.
    thin
        [m] within which a point is like one of an earlier block; 0 keeps all.
    blocks
        How many blocks ago a point may have been seen last.
    """
    made = NumpyPointMap if COMPILED is None else COMPILED.PointMap
    return cast("PointMap", made(normal_weight, cell, thin, blocks))


def icp_settings(settings: IcpSettings) -> IcpSettings:
    """Return `settings` as `make_point_map`'s maps take them."""
    return settings if COMPILED is None else cast("IcpSettings", COMPILED.IcpSettings(*settings))
