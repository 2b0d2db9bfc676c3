"""Weaving: the submaps of robots that were joined move to where all of them fit.

An alignment lays one component on another as a whole, and both are bent by what tracking errs. So
each submap is looked for in those about it, of whichever robot, as a robot closes its loops; a
robust pose graph over all robots' submaps takes what is found. The robots' maps that are handed on
bend by as much; which robots are joined, and how sure that is, was decided before.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from pydantic import Field

from mapweave.geometry import se2
from mapweave.geometry.arrays import BoolArray, FloatArray, IntArray
from mapweave.kernels.lines.evidence import near_points
from mapweave.mapping.loops.loop_closing import LoopCloser, LoopParameters
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
class _Nodes:
    """The n submaps of a cluster, component by component.

    Attributes
    ----------
    inside
        Of each component of the cluster, by its name, where its submaps are among them.
    submaps
        As their robots have them.
    component
        (n,) the place of the component of each.
    number
        (n,) which submap of its robot each is.
    middle
        (n, 2) of its path, in its own frame [m].
    """

    inside: Mapping[str, range]
    submaps: Sequence[Submap]
    component: IntArray
    number: IntArray
    middle: FloatArray

    @classmethod
    def of(cls, cluster: Cluster, submaps: Mapping[str, Sequence[Submap]]) -> "_Nodes":
        inside: dict[str, range] = {}
        together: list[Submap] = []
        for name in cluster.poses:
            inside[name] = range(len(together), len(together) + len(submaps[name]))
            together += submaps[name]
        paths = [s.trajectory.pose[:, :2] for s in together]
        middle = np.array([path.mean(axis=0) if len(path) else np.zeros(2) for path in paths])
        component = np.repeat(np.arange(len(inside)), [len(those) for those in inside.values()])
        return cls(inside, together, component, np.array([s.id for s in together]), middle)

    def believed(self, component: str) -> FloatArray:
        """(k, 3) poses of its submaps in a component, as their robot has them."""
        return _believed([self.submaps[k] for k in self.inside[component]])

    def laid(self, frames: Mapping[str, FloatArray]) -> FloatArray:
        """(n, 3) poses in the cluster's frame, the components at their `frames` there."""
        return np.vstack([se2.compose(frames[name], self.believed(name)) for name in self.inside])

    def middles(self, poses: FloatArray) -> FloatArray:
        """(n, 2) middles of their paths [m], the submaps at `poses` (n, 3)."""
        unturned = np.column_stack([self.middle, np.zeros(len(self.middle))])
        return se2.compose(poses, unturned)[:, :2]

    def follow(self, first: IntArray, second: IntArray) -> BoolArray:
        """(k,) which of pairs tracking links: the second was finished right after the first."""
        same = self.component[first] == self.component[second]
        return np.asarray(same & (self.number[second] == self.number[first] + 1))


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
        self,
        *,
        patient: bool = False,
        is_awaited: bool = True,
        is_overtaken: Callable[[], bool] = lambda: False,
    ) -> None:
        """Begin another version; one that is `patient` waits for all its comparisons.

        Parameters
        ----------
        is_awaited
            Whether somebody waits for it: then it makes few.
        is_overtaken
            If not, asked before each of them: whether something has come since.
        """
        self._tracks.turn()
        self._patient, self._is_awaited, self._is_overtaken = patient, is_awaited, is_overtaken
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
        nodes = _Nodes.of(cluster, submaps)
        before = fitted = nodes.laid(cluster.poses)
        told = [*self._tracked(nodes), *self._aligned(nodes, fitted, cluster, alignments)]
        for _ in range(self._p.rounds):
            closures = list(self._closures(nodes, fitted))
            if not closures and not _tell_bends(cluster, alignments):
                return cluster, {name: nodes.believed(name) for name in cluster.poses}
            before, (fitted, _) = fitted, optimise(fitted, [*told, *closures])
            if np.hypot(*(fitted - before)[:, :2].T).max() < self._p.step:
                break
        return _rooted(cluster, nodes, fitted)

    def _tracked(self, nodes: _Nodes) -> Iterator[Constraint]:
        """Yield how each submap of a component lies to the one before, tracked or joined."""
        for name, inside in nodes.inside.items():
            poses = nodes.believed(name)
            numbers = np.arange(inside.start, inside.stop)
            follows = nodes.follow(numbers[:-1], numbers[1:])
            steps = se2.between(poses[:-1], poses[1:])
            for k, step, followed in zip(inside, steps, follows.tolist(), strict=False):
                covariance = self._covariance(nodes.submaps[k].trajectory, step, tracked=followed)
                yield Constraint(k, k + 1, step, covariance, True)

    def _covariance(self, path: Trajectory, step: FloatArray, *, tracked: bool) -> FloatArray:
        """(3, 3) of the `step` (3,) from a submap of a component to the next one in it."""
        p = self._p.loops.graph
        if not tracked:
            return joining_covariance(p)
        return self._tracks.get((path, step.tobytes()), lambda: tracking_covariance(path, step, p))

    def _aligned(
        self,
        nodes: _Nodes,
        poses: FloatArray,
        cluster: Cluster,
        alignments: Sequence[Alignment],
    ) -> Iterator[Constraint]:
        """Yield how alignments lay submaps to each other: where they hold, if they tell.

        If not, those that are nearest, and loosely: where submaps themselves were found in each
        other, that says more.
        """
        p, inside = self._p, nodes.inside
        known = [a for a in alignments if a.decision == "accepted" and a.reference in inside]
        known = [a for a in known if a.other in inside]
        held = [list(_held(a, nodes)) for a in known]
        exact = np.diag(np.array([p.place_sigma, p.place_sigma, p.place_turn]) ** 2)
        for i, j, step in (each for those in held for each in those):
            yield Constraint(i, j, step, exact, True)
        relied = [a for a, those in zip(known, held, strict=True) if not those]
        covariance = np.diag(
            np.array([p.alignment_sigma, p.alignment_sigma, p.alignment_turn]) ** 2
        )
        if not relied:
            return
        middles = nodes.middles(poses)
        ends = [_nearest(middles, inside[a.reference], inside[a.other]) for a in relied]
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

    def _closures(self, nodes: _Nodes, poses: FloatArray) -> Iterator[Constraint]:
        """Yield how submaps at `poses` (n, 3) lie to each other that saw the same walls."""
        steps = np.array([self._p.step, self._p.step, self._p.turn_step])
        older, newer = self._candidates(nodes, poses)
        between = np.round(se2.between(poses[older], poses[newer]) / steps).astype(np.int64)
        for first, second, about in zip(
            older.tolist(), newer.tolist(), between.tolist(), strict=True
        ):
            asked = _Compared(nodes.submaps[first].map, nodes.submaps[second].map, *about)
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
        if self._is_awaited:
            return self._made >= self._p.at_once
        return self._made >= self._p.beside or self._is_overtaken()

    def _candidates(self, nodes: _Nodes, poses: FloatArray) -> tuple[IntArray, IntArray]:
        """Return pairs of nodes near each other that tracking does not link, older and newer ones.

        By the newer one, the nearest first.
        """
        p, compared = self._p, self._compared_at_all(nodes)
        middles = nodes.middles(poses)[compared]
        near = near_points(middles, middles, p.reach)
        apart = np.hypot(*(middles[near[0]] - middles[near[1]]).T)
        newer, older = compared[near[0]], compared[near[1]]
        pairs = np.flatnonzero((older < newer) & (apart < p.reach) & ~nodes.follow(older, newer))
        by_component = newer * len(nodes.inside) + nodes.component[older]
        pairs = _nearest_of_each(pairs, by_component, apart, p.candidates)
        pairs = _nearest_of_each(pairs, newer, apart, p.most)
        return older[pairs], newer[pairs]

    def _compared_at_all(self, nodes: _Nodes) -> IntArray:
        """Return the nodes with walls, without the newest of each component that has others."""
        edges = np.diff(nodes.component, prepend=-1, append=-1) != 0
        first, last = edges[:-1], edges[1:]
        walls = np.array([len(s.map.segments) > 0 for s in nodes.submaps], dtype=np.bool_)
        return np.flatnonzero(walls & (first | ~last | self._p.newest))

    def _compared(self, asked: _Compared) -> Constraint | None:
        """Look for the newer of two submaps in the older one."""
        p, path = self._p, Trajectory.empty()
        believed = np.array([asked.x * p.step, asked.y * p.step, asked.turn * p.turn_step])
        older = Submap(0, 0, se2.IDENTITY, asked.older, path)
        newer = Submap(1, 0, believed, asked.newer, path)
        return self._loops.compare_two(older, newer, 0.0).link


def _nearest_of_each(pairs: IntArray, group: IntArray, apart: FloatArray, count: int) -> IntArray:
    """Return of the `pairs` of each `group` the `count` least `apart`, group by group.

    Parameters
    ----------
    pairs
        (k,) indices, ascending where they are as far apart.
    group, apart
        (n,) of each pair there is.
    """
    pairs = pairs[np.lexsort((pairs, apart[pairs], group[pairs]))]
    begins = np.flatnonzero(np.diff(group[pairs], prepend=-1))
    rank = np.arange(len(pairs)) - np.repeat(begins, np.diff(begins, append=len(pairs)))
    return pairs[rank < count]


def _tell_bends(cluster: Cluster, alignments: Sequence[Alignment]) -> bool:
    """Whether any that are relied on lay two components on each other at several places."""
    return any(
        len(a.places) > 1 and a.decision == "accepted" and a.reference in cluster.poses
        for a in alignments
    )


def _held(alignment: Alignment, nodes: _Nodes) -> Iterator[tuple[int, int, FloatArray]]:
    """Yield the nodes that hold an alignment, and how they lie to each other there."""
    ours, theirs = (
        {nodes.submaps[k].id: k for k in nodes.inside[name]}
        for name in (alignment.reference, alignment.other)
    )
    for place in alignment.places:
        if place.reference in ours and place.other in theirs:
            yield ours[place.reference], theirs[place.other], place.transform


def _believed(submaps: Sequence[Submap]) -> FloatArray:
    """(k, 3) poses of submaps in their component, as their robot has them."""
    return np.array([s.pose for s in submaps]).reshape(-1, 3)


def _nearest(middles: FloatArray, ours: range, theirs: range) -> tuple[int, int]:
    """Return the two, one of each, whose `middles` (n, 2) are nearest to each other."""
    here, there = middles[ours], middles[theirs]
    apart = np.hypot(*(here[:, None] - there[None]).transpose(2, 0, 1))
    i, j = np.unravel_index(int(apart.argmin()), apart.shape)
    return ours[int(i)], theirs[int(j)]


def _rooted(
    cluster: Cluster, nodes: _Nodes, fitted: FloatArray
) -> tuple[Cluster, dict[str, FloatArray]]:
    """Return where components are as wholes, the first at the origin, and their submaps in them.

    Parameters
    ----------
    fitted
        (n, 3) where the nodes fit [m, m, rad].
    """
    poses, own = {}, {}
    for name, inside in nodes.inside.items():
        poses[name] = se2.fit(nodes.believed(name), fitted[inside])
        own[name] = se2.between(poses[name], fitted[inside])
    first, root = next(iter(poses.items()))
    rooted = {name: se2.between(root, pose) for name, pose in poses.items()}
    rooted[first] = np.zeros(3)
    return replace(cluster, poses=rooted), own
