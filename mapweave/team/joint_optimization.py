"""Weaving: the submaps of robots that were joined move to where all of them fit.

An alignment lays one component on another as a whole, and both are bent by what tracking errs. So
each submap is looked for in those about it, of whichever robot, as a robot closes its loops; a
robust pose graph over all robots' submaps takes what is found. The robots' maps that are handed on
bend by as much; which robots are joined, and how sure that is, was decided before.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from pydantic import Field

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.mapping.loops.loop_closing import LoopCloser, LoopParameters, middle_of_path
from mapweave.mapping.loops.pose_graph import Constraint, optimise
from mapweave.mapping.loops.submap_graph import joining_covariance, tracking_covariance
from mapweave.maps import Alignment, LineMap, Submap, Trajectory
from mapweave.parameters import StageParameters, derived
from mapweave.team.alignment_graph import Cluster
from mapweave.team.recent import Recent


class JointOptimizationParameters(StageParameters):
    """Which submaps are compared, and what alignments are worth beside that."""

    loops: LoopParameters = derived(
        lambda c: LoopParameters.of(c, min_drift=0.9, min_turn=0.1, remembered=128)
    )
    candidates: int = Field(2, ge=1, description="submaps of each component compared, the nearest")
    most: int = Field(6, ge=1, description="submaps compared with one in all, the nearest")
    reach: float = Field(8.0, gt=0, description="[m] between the middles of submaps compared")
    step: float = Field(0.25, gt=0, description="[m] places nearer to each other are searched once")
    turn_step: float = Field(0.03, gt=0, description="[rad] the same for turns")
    alignment_sigma: float = Field(
        0.3, gt=0, description="[m] of an alignment where it is held: that of whole maps, bent"
    )
    alignment_turn: float = Field(0.03, gt=0, description="[rad] the same for the turn")
    place_sigma: float = Field(0.15, gt=0, description="[m] of an alignment at a place it tells")
    place_turn: float = Field(0.02, gt=0, description="[rad] the same for the turn")
    rounds: int = Field(
        4, ge=1, description="of comparing: what moved by `step` may be within reach of others"
    )
    newest: bool = Field(
        default=False,
        description="whether the newest submap of each component is compared as well: in a running"
        " team it grows with every message, and goes along with the one before",
    )
    at_once: int = Field(
        5,
        ge=1,
        description="new comparisons for a version, some hundredths of a second; more wait for the"
        " next one, and the maps that have come do not",
    )
    beside: int = Field(
        100, ge=1, description="the same for a version that nobody waits for: half a second"
    )
    remembered: int = Field(
        5000, ge=1, description="comparisons, the last; each keeps the lines of two submaps"
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Node:
    """A submap of a component, at its pose (3,) in the cluster's frame, and its middle there."""

    component: str
    submap: Submap
    middle: tuple[float, float]

    @classmethod
    def of(cls, component: str, frame: FloatArray, submap: Submap) -> "_Node":
        placed = replace(submap, pose=se2.compose(frame, submap.pose))
        driven = len(submap.trajectory.pose) > 0
        x, y = (middle_of_path(placed) if driven else placed.pose[:2]).tolist()
        return cls(component, placed, (x, y))


class _Compared(NamedTuple):
    """Two submaps' lines, and about which step (x, y, turn) they are compared, in steps."""

    older: LineMap
    newer: LineMap
    x: int
    y: int
    turn: int


class JointOptimizer:
    """Remembers what it compared: a finished submap never changes.

    Attributes
    ----------
    has_more
        Whether comparisons wait for the next turn; once all are made, submaps lie where they would
        if these had been made at once.
    """

    def __init__(self, parameters: JointOptimizationParameters | None = None) -> None:
        self._p = parameters or JointOptimizationParameters()
        self._loops = LoopCloser(self._p.loops)
        self._known: dict[_Compared, Constraint | None] = {}  # what was asked for last comes last
        self._tracks: Recent[tuple[Trajectory, bytes], FloatArray] = Recent()
        self.turn()

    def turn(
        self, *, patient: bool = False, is_overtaken: Callable[[], bool] | None = None
    ) -> None:
        """Begin another version; one that is `patient` waits for all its comparisons.

        Parameters
        ----------
        is_overtaken
            Of a version that nobody waits for, asked before each comparison: whether something has
            come since. None where somebody waits.
        """
        self._tracks.turn()
        self._patient, self._is_overtaken = patient, is_overtaken
        self._asked = self._made = 0
        self.has_more = False

    def weave(
        self,
        cluster: Cluster,
        submaps: Mapping[str, Sequence[Submap]],
        alignments: Sequence[Alignment],
    ) -> tuple[Cluster, dict[str, FloatArray]]:
        """Return `cluster` with the poses that fit best, and where submaps lie in their components.

        These are (k, 3), of each component's submaps in their order, in its frame.

        Parameters
        ----------
        submaps
            Of each component of the cluster, by its name.
        alignments
            As they were judged; the accepted ones of the cluster's components are relied on.
        """
        nodes = [
            _Node.of(name, pose, s) for name, pose in cluster.poses.items() for s in submaps[name]
        ]
        told = [*self._tracked(nodes), *self._aligned(nodes, cluster, alignments)]
        before = fitted = np.array([n.submap.pose for n in nodes])
        for _ in range(self._p.rounds):
            closures = list(self._closures(_placed(nodes, fitted)))
            if not closures and not _tell_bends(cluster, alignments):
                return cluster, {name: _believed(submaps[name]) for name in cluster.poses}
            before, (fitted, _) = fitted, optimise(fitted, [*told, *closures])
            if np.hypot(*(fitted - before)[:, :2].T).max() < self._p.step:
                break
        return _rooted(cluster, nodes, fitted)

    def _tracked(self, nodes: Sequence[_Node]) -> Iterator[Constraint]:
        """Yield how each submap of a component lies to the one before, tracked or joined."""
        for k, (one, other) in enumerate(pairwise(nodes)):
            if one.component == other.component:
                step = se2.between(one.submap.pose, other.submap.pose)
                yield Constraint(k, k + 1, step, self._covariance(one, other, step), True)

    def _covariance(self, one: _Node, other: _Node, step: FloatArray) -> FloatArray:
        """(3, 3) of the `step` (3,) from a submap of a component to the next one in it."""
        path, p = one.submap.trajectory, self._p.loops.graph
        if not _follows(one, other):
            return joining_covariance(p)
        return self._tracks.get((path, step.tobytes()), lambda: tracking_covariance(path, step, p))

    def _aligned(
        self, nodes: Sequence[_Node], cluster: Cluster, alignments: Sequence[Alignment]
    ) -> Iterator[Constraint]:
        """Yield how alignments lay submaps to each other: where they hold, if they tell.

        If not, those that are nearest, and loosely: where submaps themselves were found in each
        other, that says more.
        """
        p, inside = self._p, _by_component(nodes)
        known = [a for a in alignments if a.decision == "accepted" and a.reference in inside]
        known = [a for a in known if a.other in inside]
        held = [list(_held(a, nodes, inside)) for a in known]
        exact = np.diag(np.array([p.place_sigma, p.place_sigma, p.place_turn]) ** 2)
        for i, j, step in (each for those in held for each in those):
            yield Constraint(i, j, step, exact, True)
        relied = [a for a, those in zip(known, held, strict=True) if not those]
        covariance = np.diag(
            np.array([p.alignment_sigma, p.alignment_sigma, p.alignment_turn]) ** 2
        )
        if not relied:
            return
        ends = [_nearest(nodes, inside[a.reference], inside[a.other]) for a in relied]
        poses = np.array([n.submap.pose for n in nodes])
        first, second = (
            se2.between(np.array([cluster.poses[n] for n in names]), poses[list(those)])
            for names, those in (
                ([a.reference for a in relied], [i for i, _ in ends]),
                ([a.other for a in relied], [j for _, j in ends]),
            )
        )
        there = se2.compose(np.array([a.transform for a in relied]), second)
        for (i, j), step in zip(ends, se2.between(first, there), strict=True):
            yield Constraint(i, j, step, covariance, True)

    def _closures(self, nodes: Sequence[_Node]) -> Iterator[Constraint]:
        """Yield how submaps lie to each other that saw the same walls."""
        steps = np.array([self._p.step, self._p.step, self._p.turn_step])
        pairs = list(self._candidates(nodes))
        poses = np.array([n.submap.pose for n in nodes])
        older, newer = np.array(pairs, dtype=np.int64).reshape(-1, 2).T
        between = np.round(se2.between(poses[older], poses[newer]) / steps).astype(np.int64)
        for (first, second), about in zip(pairs, between.tolist(), strict=True):
            asked = _Compared(nodes[first].submap.map, nodes[second].submap.map, *about)
            link = self._link(asked)
            if link is not None:
                yield Constraint(first, second, link.transform, link.covariance, link.trusted)

    def _link(self, asked: _Compared) -> Constraint | None:
        """Return what comparing comes to; None where it shows nothing, or has to wait."""
        self._asked += 1
        if asked in self._known:
            link = self._known.pop(asked)
        elif self._has_made_enough():
            self.has_more = True
            return None
        else:
            self._made += 1
            link = self._compared(asked)
        self._known[asked] = link
        # Never what this version asks for: the next one would have to compare it again, for ever.
        while len(self._known) > max(self._p.remembered, self._asked):
            del self._known[next(iter(self._known))]
        return link

    def _has_made_enough(self) -> bool:
        """Whether further comparisons are for the next version."""
        if self._patient:
            return False
        if self._is_overtaken is None:
            return self._made >= self._p.at_once
        return self._made >= self._p.beside or self._is_overtaken()

    def _candidates(self, nodes: Sequence[_Node]) -> Iterator[tuple[int, int]]:
        """Yield pairs of nodes near each other that tracking does not link."""
        p = self._p
        compared = [k for k in self._finished(nodes) if len(nodes[k].submap.map.segments)]
        middles = np.array([nodes[k].middle for k in compared]).reshape(-1, 2)
        for last, k in enumerate(compared):
            apart = np.hypot(*(middles[:last] - middles[last]).T)
            near: dict[str, list[tuple[float, int]]] = {}
            for at in np.flatnonzero(apart < p.reach).tolist():
                j = compared[at]
                if not _is_tracked(nodes, j, k):
                    near.setdefault(nodes[j].component, []).append((float(apart[at]), j))
            nearest = sorted(
                pair for those in near.values() for pair in sorted(those)[: p.candidates]
            )
            yield from ((j, k) for _, j in nearest[: p.most])

    def _finished(self, nodes: Sequence[_Node]) -> list[int]:
        """Return the nodes without the newest of each component, unless that is its only one."""
        following = [n.component for n in nodes[1:]] + [None]
        before = [None] + [n.component for n in nodes[:-1]]
        return [
            k
            for k, node in enumerate(nodes)
            if self._p.newest or node.component == following[k] or node.component != before[k]
        ]

    def _compared(self, asked: _Compared) -> Constraint | None:
        """Look for the newer of two submaps in the older one."""
        p, path = self._p, Trajectory.empty()
        believed = np.array([asked.x * p.step, asked.y * p.step, asked.turn * p.turn_step])
        older = Submap(0, 0, se2.IDENTITY, asked.older, path)
        newer = Submap(1, 0, believed, asked.newer, path)
        return self._loops.compare_two(older, newer, 0.0).link


def _placed(nodes: Sequence[_Node], poses: FloatArray) -> list[_Node]:
    """Return nodes at the (n, 3) `poses` in the cluster's frame."""
    return [
        node
        if np.array_equal(node.submap.pose, pose)
        else _Node.of(node.component, se2.IDENTITY, replace(node.submap, pose=pose))
        for node, pose in zip(nodes, poses, strict=True)
    ]


def _tell_bends(cluster: Cluster, alignments: Sequence[Alignment]) -> bool:
    """Whether any that are relied on lay two components on each other at several places."""
    return any(
        len(a.places) > 1 and a.decision == "accepted" and a.reference in cluster.poses
        for a in alignments
    )


def _held(
    alignment: Alignment, nodes: Sequence[_Node], inside: Mapping[str, Sequence[int]]
) -> Iterator[tuple[int, int, FloatArray]]:
    """Yield the nodes that hold an alignment, and how they lie to each other there."""
    ours, theirs = (
        {nodes[k].submap.id: k for k in inside[name]}
        for name in (alignment.reference, alignment.other)
    )
    for place in alignment.places:
        if place.reference in ours and place.other in theirs:
            yield ours[place.reference], theirs[place.other], place.transform


def _believed(submaps: Sequence[Submap]) -> FloatArray:
    """(k, 3) poses of submaps in their component, as their robot has them."""
    return np.array([s.pose for s in submaps]).reshape(-1, 3)


def _follows(one: _Node, other: _Node) -> bool:
    """Whether the second was finished right after the first."""
    return other.submap.id == one.submap.id + 1


def _is_tracked(nodes: Sequence[_Node], first: int, second: int) -> bool:
    """Whether tracking links two nodes."""
    one, other = nodes[first], nodes[second]
    return one.component == other.component and _follows(one, other)


def _by_component(nodes: Sequence[_Node]) -> dict[str, list[int]]:
    inside: dict[str, list[int]] = {}
    for k, node in enumerate(nodes):
        inside.setdefault(node.component, []).append(k)
    return inside


def _nearest(nodes: Sequence[_Node], ours: Sequence[int], theirs: Sequence[int]) -> tuple[int, int]:
    """Return the two, one of each, whose middles are nearest to each other."""
    here, there = (np.array([nodes[k].middle for k in those]) for those in (ours, theirs))
    apart = np.hypot(*(here[:, None] - there[None]).transpose(2, 0, 1))
    i, j = np.unravel_index(int(apart.argmin()), apart.shape)
    return ours[int(i)], theirs[int(j)]


def _rooted(
    cluster: Cluster, nodes: Sequence[_Node], fitted: FloatArray
) -> tuple[Cluster, dict[str, FloatArray]]:
    """Return where components are as wholes, the first at the origin, and their submaps in them.

    Parameters
    ----------
    fitted
        (n, 3) where the nodes fit [m, m, rad].
    """
    poses, own, by_component = {}, {}, _by_component(nodes)
    for name, frame in cluster.poses.items():
        inside = by_component[name]
        before = se2.between(frame, np.array([nodes[k].submap.pose for k in inside]))
        poses[name] = se2.fit(before, fitted[inside])
        own[name] = se2.between(poses[name], fitted[inside])
    first, root = next(iter(poses.items()))
    rooted = {name: se2.between(root, pose) for name, pose in poses.items()}
    rooted[first] = np.zeros(3)
    return replace(cluster, poses=rooted), own
