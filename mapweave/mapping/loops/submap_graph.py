"""What is known of how a robot's submaps lie to each other: tracking, joins and closures.

However many submaps there are, a closure moves those around it: what is many links away is held,
unless the loop that was closed is a long one.
"""

import heapq
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from mapweave.geometry import se2
from mapweave.geometry.arrays import BoolArray, FloatArray
from mapweave.mapping.continuation import links_to_keep
from mapweave.mapping.drifted_paths import beyond
from mapweave.mapping.loops.pose_graph import Constraint, optimise
from mapweave.maps import Submap, Trajectory

CLOSURE_LENGTH = 2.0  # [m] of tracked path that errs about as much as a closure
OPEN_STEP = 0.5  # [m], [rad] that a scan counts, however far off it may be


class SubmapGraphParameters(BaseModel):
    """How sure tracking is, and how far a closure reaches."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    tracking_sigma: float = Field(
        0.05,
        gt=0,
        description="[m] from a submap to the next where it is not known how well its scans were"
        " held; median error against the corrected poses of five logs: 0.03-0.07 m",
    )
    tracking_turn: float = Field(
        0.009, gt=0, description="[rad] the same for the turn; median 0.15-0.6°"
    )
    drift: float = Field(
        2.0,
        gt=0,
        description="by how much more a submap errs than one of its scans: those are held to"
        " 0.022-0.028 m (median of five logs), in corridors less along them",
    )
    joining_sigma: float = Field(0.1, gt=0, description="[m] of components joined by their shapes")
    joining_turn: float = Field(0.01, gt=0, description="[rad] of components joined")
    kept_near: float = Field(
        6.0, gt=0, description="[m] between submaps of an earlier run that stay as they lie"
    )
    reach: int = Field(80, ge=2, description="submaps that a closure moves, the fewest links away")
    long_loop: int = Field(
        40, ge=1, description="links round a loop from which on all submaps are moved"
    )


class SubmapGraph:
    """The links between the submaps of a robot; their ids count from 0."""

    def __init__(self, parameters: SubmapGraphParameters) -> None:
        self._parameters = parameters
        self._links: list[Constraint] = []
        self._relied: list[bool] = []
        self._lengths: list[float] = []

    def track(self, previous: Submap, submap: Submap) -> None:
        """Note that `submap` followed `previous`, both of one component, by tracking."""
        step = se2.between(previous.pose, submap.pose)
        covariance = tracking_covariance(previous.trajectory, step, self._parameters)
        self._trust(
            Constraint(previous.id, submap.id, step, covariance, True), submap.trajectory.length
        )

    def take_over(self, submaps: Sequence[Submap]) -> None:
        """Note how submaps of an earlier run lie to each other: those that follow, or are near.

        What held them there is not stored; where they lie is what all of it came to.
        """
        covariance = joining_covariance(self._parameters)
        for first, second in links_to_keep(submaps, self._parameters.kept_near):
            step = se2.between(first.pose, second.pose)
            length = second.trajectory.length if second.id == first.id + 1 else CLOSURE_LENGTH
            self._trust(Constraint(first.id, second.id, step, covariance, True), length)

    def part(self, submaps: Sequence[Submap], first: int) -> list[Submap]:
        """Forget all links between those of `submaps` before number `first` and the others.

        These are elsewhere. Returns those before, at the poses that fit what is left: closures of
        the others may have moved them.
        """
        crossing = [(e.first < first) != (e.second < first) for e in self._links]
        closed = any(
            c and relied and not e.trusted
            for c, relied, e in zip(crossing, self._relied, self._links, strict=True)
        )
        kept = [k for k, c in enumerate(crossing) if not c]
        self._links = [self._links[k] for k in kept]
        self._relied = [self._relied[k] for k in kept]
        self._lengths = [self._lengths[k] for k in kept]
        left = list(submaps[:first])
        moved = np.array([s.component == submaps[-1].component for s in left])
        if not closed or moved.sum() < 2:
            return left
        return self._fitted(left, np.append(moved, np.zeros(len(submaps) - first, dtype=np.bool_)))

    def join(self, older: Submap, younger: Submap) -> None:
        """Note that two components were joined, at the present poses of these two submaps."""
        covariance = joining_covariance(self._parameters)
        step = se2.between(older.pose, younger.pose)
        self._trust(
            Constraint(older.id, younger.id, step, covariance, True), younger.trajectory.length
        )

    def lengths_from(self, submap: int, count: int) -> FloatArray:
        """(count,) [m] of tracked path by which each submap is known relative to `submap`.

        Along the shortest chain of links: a closure shortens it, and with it the drift.
        """
        return self._shortest(submap, count, np.array(self._lengths))

    def neighbours(self, submap: int) -> list[int]:
        """Return the ids of the submaps to which links that are relied on lead from `submap`."""
        ends = {
            (link.first, link.second)
            for link, relied in zip(self._links, self._relied, strict=True)
            if relied and submap in (link.first, link.second)
        }
        return sorted(first + second - submap for first, second in ends)

    def close(self, submaps: Sequence[Submap], closures: Sequence[Constraint]) -> list[Submap]:
        """Return `submaps` at the poses that fit all links, with `closures` of the last one."""
        if not closures:
            return list(submaps)
        newest = submaps[-1]
        hops = self._shortest(newest.id, len(submaps), np.ones(len(self._links)))
        self._links += closures
        self._relied += [False] * len(closures)
        self._lengths += [CLOSURE_LENGTH] * len(closures)
        moved = np.array([s.component == newest.component for s in submaps])
        if max(hops[k.first] for k in closures) <= self._parameters.long_loop:
            nearest = np.argsort(hops, kind="stable")[: self._parameters.reach]
            moved &= np.isin(np.arange(len(submaps)), nearest)
        return self._fitted(submaps, moved)

    def _trust(self, link: Constraint, length: float) -> None:
        self._links.append(link)
        self._relied.append(True)
        self._lengths.append(length)

    def _shortest(self, submap: int, count: int, weight: FloatArray) -> FloatArray:
        """(count,) the least sum of `weight` of links that are relied on, from `submap`."""
        around: list[list[tuple[int, float]]] = [[] for _ in range(count)]
        for w, k, relied in zip(weight.tolist(), self._links, self._relied, strict=True):
            if relied:
                around[k.first].append((k.second, w))
                around[k.second].append((k.first, w))
        # Dijkstra's way; SciPy's takes longer to load than these few links to follow.
        chains, reached = np.full(count, np.inf), [(0.0, submap)]
        while reached:
            length, here = heapq.heappop(reached)
            if length < chains[here]:
                chains[here] = length
                for there, w in around[here]:
                    heapq.heappush(reached, (length + w, there))
        return chains

    def _fitted(self, submaps: Sequence[Submap], moved: BoolArray) -> list[Submap]:
        """Fit the submaps that may be `moved` (n,) to the links; their neighbours hold them."""
        used = [k for k, e in enumerate(self._links) if moved[e.first] or moved[e.second]]
        links = [self._links[k] for k in used]
        ids = sorted({i for e in links for i in (e.first, e.second)})
        index = {number: k for k, number in enumerate(ids)}
        inner = [
            Constraint(index[e.first], index[e.second], e.transform, e.covariance, e.trusted)
            for e in links
        ]
        held = [index[i] for i in ids if not moved[i]] or [0]
        start = np.array([submaps[i].pose for i in ids])
        poses, relied = optimise(start, inner, held)
        for k, reliable in zip(used, relied.tolist(), strict=True):
            self._relied[k] = reliable
        return [replace(s, pose=poses[index[s.id]]) if moved[s.id] else s for s in submaps]


def joining_covariance(p: SubmapGraphParameters) -> FloatArray:
    """(3, 3) of a step between submaps of components that were joined by their shapes."""
    return np.diag(np.array([p.joining_sigma, p.joining_sigma, p.joining_turn]) ** 2)


def tracking_covariance(path: Trajectory, step: FloatArray, p: SubmapGraphParameters) -> FloatArray:
    """(3, 3) of a tracked `step` (3,) to the frame at its end, along the scans of `path`.

    In a direction in which the scans were held worse, as along a corridor, it errs more.
    """
    held = path.uncertainty
    if held is None or not held.any():
        return np.diag(np.array([p.tracking_sigma, p.tracking_sigma, p.tracking_turn]) ** 2)
    least, across, turn = (beyond(each, OPEN_STEP) for each in held.T[:3])
    direction = held[:, 3]
    c, s = np.cos(direction - step[2]), np.sin(direction - step[2])
    axes = np.stack([np.column_stack([c, s]), np.column_stack([-s, c])])
    squares = np.stack([least, across]) ** 2
    covariance = np.zeros((3, 3))
    covariance[:2, :2] = np.einsum("kn,kni,knj->ij", squares, axes, axes) / len(held)
    covariance[:2, :2] *= p.drift**2
    covariance[2, 2] = (turn**2).mean()
    return covariance
