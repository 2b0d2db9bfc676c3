"""Which alignments to rely on, and the poses that follow.

Accepted alignments are links between components. The most probable explanation of them all says
which are right, given what the maps say of how they come to lie; the others are set aside and
named. The poses are fitted to those that are right.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TypeAlias

import numpy as np
from pydantic import Field

from mapweave.fusion.extrapolation import ExtrapolationParameters, bend
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.mapping.loops.pose_graph import Constraint, optimise
from mapweave.maps import Alignment
from mapweave.matching.distance_field import DistanceField
from mapweave.parameters import StageParameters, derived
from mapweave.reasons import Pair, Reason, ReasonKind, Status, StatusKind
from mapweave.team.consistency import ConsistencyParameters, bits, explain
from mapweave.team.contradictions import (
    ContradictionParameters,
    KnownVerdicts,
    MapContradictions,
    PairVerdict,
    PairVerdicts,
)
from mapweave.team.cycles import Edge, misfit, poses_along
from mapweave.team.inliers import component_confidence, part_right, rely, weakest_link
from mapweave.team.min_cut import groups
from mapweave.team.orders.bans import Ban, Bans
from mapweave.team.recent import Recent

# By the alignment, the numbers of its components, and the frames at their middles.
KnownEdges: TypeAlias = Recent[tuple[Alignment, int, int, bytes, bytes], Edge]


class AlignmentGraphParameters(StageParameters):
    """How alignments are weighed against each other, and the poses fitted to them."""

    explanations: ConsistencyParameters = ConsistencyParameters()
    contradictions: ContradictionParameters = derived(ContradictionParameters.of)
    reach: ExtrapolationParameters = ExtrapolationParameters()
    sigma: float = Field(0.1, gt=0, description="[m] of an alignment's translation")
    turn_sigma: float = Field(0.01, gt=0, description="[rad] of an alignment's rotation")


@dataclass(frozen=True, slots=True, eq=False)
class Cluster:
    """Components whose relative poses are known.

    Attributes
    ----------
    poses
        Component name to its (3,) pose; the first has the identity.
    confidence
        Of the weakest part needed, strengthened by cycles; 1 for one component alone.
    """

    poses: Mapping[str, FloatArray]
    confidence: float


def cluster_components(
    names: Sequence[str],
    alignments: Sequence[Alignment],
    parameters: AlignmentGraphParameters,
    rasters: Mapping[str, DistanceField] | None = None,
    verdicts: KnownVerdicts | None = None,
    bans: Sequence[Ban] = (),
    edges: KnownEdges | None = None,
) -> tuple[list[Cluster], tuple[Alignment, ...]]:
    """Return the clusters, largest first, and `alignments` with those set aside made ambiguous.

    Each that was accepted has a status: relied on, held or set aside.
    What contradictions leave of an alignment's confidence is given with it. Alignments that name
    components not in `names` are left out.

    Parameters
    ----------
    rasters
        The maps of those components that have seen any wall, each in its frame: they object to
        alignments that contradict them. What alignments differ by is measured at the maps'
        middles, because that depends on no frame; without a map, at the component's origin.
    verdicts
        Of maps about each other, those of versions before among them.
    bans
        What operators forbid, between the numbers of `names` and at the maps' middles.
    edges
        What alignments are in the graph, those of versions before among them.
    """
    known = set(names)
    alignments = [a for a in alignments if a.reference in known and a.other in known]
    graph = _Graph(names, alignments, parameters, rasters or {}, verdicts, bans, edges)
    judged = tuple(graph.judge(alignment) for alignment in alignments)
    return sorted(graph.clusters(), key=lambda c: -len(c.poses)), judged


class _Graph:
    """The accepted alignments between numbered components, in frames at their middles."""

    def __init__(
        self,
        names: Sequence[str],
        alignments: Sequence[Alignment],
        parameters: AlignmentGraphParameters,
        rasters: Mapping[str, DistanceField],
        verdicts: KnownVerdicts | None,
        bans: Sequence[Ban],
        known: KnownEdges | None,
    ) -> None:
        self._names, self._parameters = names, parameters
        self._number = {name: number for number, name in enumerate(names)}
        self._middles = np.array([frame_at_middle(rasters.get(name)) for name in names])
        links = [a for a in alignments if a.decision == "accepted" and a.reference != a.other]
        # In an order of their own, so that the order in which they came changes nothing.
        links.sort(key=lambda a: (-a.confidence, a.reference, a.other, *a.transform))
        self._edge_of = {id(link): k for k, link in enumerate(links)}
        self._edges = self._made_of(links, Recent() if known is None else known)
        self._rigid = [_rigid(link) for link in links]
        seen = {self._number[name]: raster for name, raster in rasters.items()}
        witnesses = PairVerdicts(seen, self._middles, parameters.contradictions, verdicts)
        self._doubts = MapContradictions(len(names), self._edges, witnesses)
        p = parameters.explanations
        self._bans = Bans(len(names), self._edges, bans)
        self._explanations = explain(len(names), self._edges, p, self._doubts, self._bans)
        self._right = rely(len(names), self._edges, self._explanations)

    def _made_of(self, links: Sequence[Alignment], known: KnownEdges) -> list[Edge]:
        """Return the edge of each of `links`, in their order."""
        ends = [(self._number[link.reference], self._number[link.other]) for link in links]
        frames = [frame.tobytes() for frame in self._middles]
        return [
            known.get((link, i, j, frames[i], frames[j]), partial(self._edge, link, i, j))
            for link, (i, j) in zip(links, ends, strict=True)
        ]

    def _edge(self, link: Alignment, first: int, second: int) -> Edge:
        there = se2.compose(link.transform, self._middles[second])
        # What is asked first is whether the places are right; that maps are bent is no objection.
        bent = bend(link.evidence.reach or 0.0, self._parameters.reach)
        transform = se2.between(self._middles[first], there)
        # The transform is of the first place: at the others the maps may be bent against it.
        at = np.array([place.at for place in link.places[:1]]).reshape(-1, 2)
        held = se2.transform_points(se2.inverse(self._middles[first]), at)
        return Edge(first, second, transform, _place(link), bent, held, pinned=_is_pinned(link))

    def clusters(self) -> list[Cluster]:
        """Return the clusters, in the order of their first components."""
        count, p = len(self._names), self._parameters.explanations
        return [
            Cluster(
                self._poses(group),
                component_confidence(group, count, self._edges, self._right, self._explanations, p)
                * weakest_link(group, count, self._edges, self._right, self._rigid),
            )
            for group in groups(count, self._edges, self._right)
        ]

    def judge(self, alignment: Alignment) -> Alignment:
        """Return `alignment`: less sure if others contradict it, and ambiguous if set aside."""
        edge = self._edge_of.get(id(alignment))
        if edge is None:
            is_judged = alignment.cause.kind is ReasonKind.FORBIDDEN
            known = alignment.status is None or is_judged
            return alignment if known else replace(alignment, status=None)
        sure = min(alignment.confidence, part_right(edge, self._explanations))
        if edge not in self._right:
            cause, by = self._objection(edge, alignment.cause)
            status = Status(StatusKind.SET_ASIDE, by)
            return replace(
                alignment, decision="ambiguous", confidence=sure, cause=cause, status=status
            )
        is_held = alignment.cause.kind is ReasonKind.MET_BEFORE
        status = Status(StatusKind.HELD if is_held else StatusKind.RELIED_ON)
        return replace(alignment, confidence=sure, status=status)

    def _objection(self, k: int, found: Reason) -> tuple[Reason, tuple[Pair, ...]]:
        """Return what speaks against edge `k`, of which this was `found`, and who says so."""
        edge = self._edges[k]
        present = sorted(self._right)
        ban = self._bans.broken_by(k, present)
        if ban is not None:
            cause = Reason(ReasonKind.FORBIDDEN_BETWEEN, found=found, text=ban.words)
            return cause, (ban.names,)
        poses, paths = poses_along(edge.first, len(self._names), self._edges, present)
        if paths[edge.second] >= 0:
            off = misfit(edge.transform, poses[edge.first], poses[edge.second])
            others = sorted((self._ends(other) for other in bits(paths[edge.second])), key="-".join)
            numbers = {"distance": float(np.hypot(off[0], off[1])), "turn": float(abs(off[2]))}
            return Reason(ReasonKind.OTHERS_CONTRADICT, numbers, found), tuple(others)
        alone = self._witness_against(k, [*present, k])
        if alone:
            return self._testimony(ReasonKind.MAPS_CONTRADICT, alone, found)
        together = self._witness_against(k, range(len(self._edges)))
        if together:
            return self._testimony(ReasonKind.MAPS_CONTRADICT_JOINTLY, together, found)
        return Reason(ReasonKind.UNDECIDED, found=found), ()

    def _witness_against(self, k: int, present: Sequence[int]) -> PairVerdict | None:
        """Who speaks most against those joined by way of edge `k`, with the edges `present`."""
        found = []
        for witness in self._doubts.against(sorted(present)):
            _, paths = poses_along(witness.first, len(self._names), self._edges, sorted(present))
            if paths[witness.second] >> k & 1:
                found.append(witness)
        return max(found, key=lambda witness: witness.doubt, default=None)

    def _testimony(
        self, kind: ReasonKind, witness: PairVerdict, found: Reason
    ) -> tuple[Reason, tuple[Pair, ...]]:
        v = witness.tally
        cause = Reason(kind, {"common": v.common, "contradicted": v.contradicted}, found)
        return cause, ((self._names[witness.first], self._names[witness.second]),)

    def _ends(self, k: int) -> Pair:
        edge = self._edges[k]
        return self._names[edge.first], self._names[edge.second]

    def _poses(self, group: Sequence[int]) -> dict[str, FloatArray]:
        """Poses of the components of `group`, the first in its own frame."""
        if len(group) == 1:
            return {self._names[group[0]]: np.zeros(3)}
        inside = [k for k in sorted(self._right) if self._edges[k].first in group]
        poses, _ = poses_along(group[0], len(self._names), self._edges, inside)
        fitted = poses[list(group)]
        if len(inside) >= len(group):  # a tree fits as it stands
            fitted = self._fitted(group, inside, fitted)
        frames = se2.compose(fitted, se2.inverse(self._middles[list(group)]))
        frames = se2.between(frames[0], frames)
        frames[0] = 0.0
        return {self._names[node]: pose for node, pose in zip(group, frames, strict=True)}

    def _fitted(self, group: Sequence[int], inside: Sequence[int], start: FloatArray) -> FloatArray:
        """(n, 3) poses that fit all edges `inside`, from `start`."""
        p = self._parameters
        place = {node: k for k, node in enumerate(group)}
        links = [
            Constraint(place[e.first], place[e.second], e.transform, _covariance(e, p), trusted)
            for e, trusted in self._with_bridges(inside)
        ]
        return optimise(start, links)[0]

    def _with_bridges(self, inside: Sequence[int]) -> Iterator[tuple[Edge, bool]]:
        """Yield the edges `inside`, and of each whether all hangs on it: nothing can refute it."""
        count = len(self._names)
        _, paths = poses_along(self._edges[inside[0]].first, count, self._edges, inside)
        cycles = 0  # the edges in any: those in one that an edge closes with the paths to its ends
        for k in inside:
            closing = paths[self._edges[k].first] ^ paths[self._edges[k].second]
            if closing != 1 << k:
                cycles |= closing | 1 << k
        for k in inside:
            yield self._edges[k], not cycles >> k & 1


def _is_pinned(link: Alignment) -> bool:
    return link.cause.kind is ReasonKind.PINNED


def _place(link: Alignment) -> float:
    """How probably the place is right; all that is known where nobody tells of the place."""
    place = link.evidence.place
    told = place is not None and math.isfinite(place) and not _is_pinned(link)
    return place if told and place is not None else link.confidence


def _rigid(link: Alignment) -> float:
    """How probably the maps are right as wholes, if the place is."""
    return min(link.confidence / max(_place(link), link.confidence, 1e-9), 1.0)


def _covariance(edge: Edge, p: AlignmentGraphParameters) -> FloatArray:
    """(3, 3) of an alignment between the middles of two maps."""
    squared = p.sigma**2 + edge.bend**2
    return np.diag([squared, squared, p.turn_sigma**2])


def frame_at_middle(raster: DistanceField | None) -> FloatArray:
    """Return the (3,) frame at the middle of a map's wall; the map's own where it has seen none."""
    x, y = raster.middle if raster else (0.0, 0.0)
    return np.array([x, y, 0.0])
