"""One component of a joint map: the walls of all that was joined, merged (paper, VI and VII)."""

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import NamedTuple, TypeAlias, TypeVar

import numpy as np
from shapely.geometry.base import BaseGeometry

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray, IntArray
from mapweave.geometry.segments import lengths
from mapweave.lines.merging import MergingParameters, evolve
from mapweave.lines.polylines import group_polylines
from mapweave.lines.simplification import SimplificationParameters, simplify, sources
from mapweave.maps import JointComponent, LineMap
from mapweave.matching.distance_field import DistanceFieldParameters
from mapweave.parameters import StageParameters, derived
from mapweave.scan.free_space import FreeSpaceParameters, from_rings, rings, unite
from mapweave.team.alignment_graph import AlignmentGraphParameters, Cluster
from mapweave.team.recent import Recent
from mapweave.team.walls.joined_before import Seen, staying
from mapweave.team.walls.merging_tree import KnownMergings, Walls, merge_all
from mapweave.team.walls.segment_confidence import (
    SegmentConfidenceParameters,
    Voices,
    Witness,
    segment_confidence,
)

A = TypeVar("A")
B = TypeVar("B")

STEPS = np.array(
    [2e-3, 2e-3, 2e-4]
)  # [m, m, rad] by which pieces are laid: what a laser cannot tell


class JointParameters(StageParameters):
    """How robots' maps become one."""

    graph: AlignmentGraphParameters = derived(AlignmentGraphParameters.of)
    merging: MergingParameters = derived(
        lambda c: MergingParameters.of(c, max_step=0.25, max_cost=0.2)
    )
    simplification: SimplificationParameters = derived(SimplificationParameters.of)
    free_space: FreeSpaceParameters = derived(FreeSpaceParameters.of)
    raster: DistanceFieldParameters = derived(DistanceFieldParameters.of)
    max_gap: float = derived(
        lambda c: c.mapping.max_gap, gt=0, description="[m] within a generalized polyline"
    )
    segments: SegmentConfidenceParameters = derived(SegmentConfidenceParameters.of)


@dataclass(frozen=True, slots=True, eq=False)
class Piece:
    """Lines that lie rigidly to each other: a submap, or a whole component.

    Attributes
    ----------
    lines
        In a frame of their own.
    witness
        What they say of walls; None where no wall was seen.
    pose
        (3,) of their frame in the component's [m, m, rad].
    joined
        (n,) how sure each wall is, where it is a component of a joint map; None of what was mapped.
    """

    lines: LineMap
    witness: Witness | None
    pose: FloatArray
    joined: FloatArray | None = None


class Kept:
    """What joining makes of pieces that stay where they are, from one version to the next."""

    def __init__(self) -> None:
        self.placed: Recent[tuple[LineMap, tuple[int, ...]], Placed] = Recent()
        self.mergings: KnownMergings = Recent()
        self.joined: Recent[tuple[tuple[Laid, ...], ...], Joined] = Recent()

    def turn(self) -> None:
        """Begin another version."""
        self.placed.turn()
        self.mergings.turn()
        self.joined.turn()


@dataclass(frozen=True, slots=True, eq=False)
class Placed:
    """A piece where it lies in the joint component's frame.

    Attributes
    ----------
    pose
        (3,) [m, m, rad].
    walls
        Its segments, merged; None of what was joined before.
    middle
        (2,) of these walls [m].
    seen
        Its lines as they are.
    joined
        (n,) how sure each wall is, if it was joined before.
    """

    pose: FloatArray
    walls: Walls | None
    middle: FloatArray
    seen: LineMap
    joined: FloatArray | None


class Laid(NamedTuple):
    """A piece's lines, what they say of walls, and where they lie."""

    lines: LineMap
    witness: Witness | None
    placed: Placed


Joined: TypeAlias = tuple[LineMap, FloatArray]
"""Walls, and (n,) how sure each of them is."""


def join(
    cluster: Cluster,
    pieces: Mapping[str, Sequence[Piece]],
    p: JointParameters,
    kept: Kept | None = None,
) -> JointComponent:
    """Return the components of `cluster`, each of its `pieces`, as one.

    Pieces are laid down at whole steps far below what a laser can tell: so most of them stay where
    they are when others are moved, and so does what was made of them.
    """
    kept = kept or Kept()
    laid = tuple(
        tuple(
            Laid(piece.lines, piece.witness, _placed(piece, frame, p, kept))
            for piece in pieces[name]
        )
        for name, frame in cluster.poses.items()
    )
    lines, sure = kept.joined.get(laid, lambda: _joined(laid, p, kept))
    _merged(laid, p, kept)  # asked for every time, so that what was merged is kept as well
    return JointComponent(cluster.poses, cluster.confidence, lines, sure)


def _joined(laid: Sequence[Sequence[Laid]], p: JointParameters, kept: Kept) -> Joined:
    """Return the walls of all pieces; what was merged of them is `kept`."""
    together = [each.placed for those in laid for each in those]
    if len(together) == 1 and together[0].joined is not None:
        return together[0].seen, together[0].joined
    merged, (free, free_space) = _both(
        lambda: _merged(laid, p, kept), lambda: _free_space(together, p)
    )
    seen = _seen(laid)
    stays = staying(seen, p.simplification)
    known, new = seen.those(stays), seen.those(~stays)
    again = new.segments[~np.isnan(new.sure)]
    lines, order = _simplified(np.concatenate([merged, again]), known, new, free, p)
    lines = replace(lines, free_space=free_space)
    views = [
        [(each.witness, each.placed.pose) for each in those if each.witness is not None]
        for those in laid
    ]
    return lines, segment_confidence(lines, views, p.segments, _voices(known, order))


def _both(first: Callable[[], A], second: Callable[[], B]) -> tuple[A, B]:
    """Return what two make of nothing that is shared, the second in a thread of its own."""
    with ThreadPoolExecutor(1) as beside:
        other = beside.submit(second)
        return first(), other.result()


def _seen(laid: Sequence[Sequence[Laid]]) -> Seen:
    """Return all walls as the pieces have them."""
    together = [(view, each.placed) for view, those in enumerate(laid) for each in those]
    counts = [len(placed.seen.segments) for _, placed in together]
    lines = LineMap.union([placed.seen for _, placed in together])
    sure = [
        np.full(count, np.nan) if placed.joined is None else placed.joined
        for count, (_, placed) in zip(counts, together, strict=True)
    ]
    return Seen(
        lines.segments,
        lines.support,
        np.concatenate([np.empty(0), *sure]),
        np.repeat(np.array([view for view, _ in together], dtype=np.int64), counts),
        np.repeat(np.arange(len(together)), counts),
    )


def _free_space(
    together: Sequence[Placed], p: JointParameters
) -> tuple[BaseGeometry, tuple[FloatArray, ...]]:
    """Return all that was seen through, and its rings: those of joint maps as they were."""
    free = unite([ring for each in together for ring in each.seen.free_space], p.free_space)
    before = [ring for each in together if each.joined is not None for ring in each.seen.free_space]
    if not before:
        return free, rings(free)
    beyond = rings(free.difference(from_rings(before)))
    return free, (*before, *rings(unite(beyond, p.free_space)))


def _voices(known: Seen, order: IntArray) -> Voices:
    """Return what was said of walls before, those `known` first and then put into `order`."""
    new = len(order) - len(known.segments)
    view = np.concatenate([known.view, np.full(new, -1)])
    return Voices(view[order], np.concatenate([known.share, np.ones(new)])[order])


def _placed(piece: Piece, frame: FloatArray, p: JointParameters, kept: Kept) -> Placed:
    """Lay `piece` down in the component that is at `frame` (3,)."""
    if piece.joined is not None:
        pose = se2.compose(frame, piece.pose)
        return Placed(pose, None, pose[:2], piece.lines.moved(pose), piece.joined)
    steps = np.round(se2.compose(frame, piece.pose) / STEPS).astype(np.int64)
    key = piece.lines, tuple(steps.tolist())
    return kept.placed.get(key, lambda: _laid_down(piece.lines, steps * STEPS, p))


def _laid_down(lines: LineMap, pose: FloatArray, p: JointParameters) -> Placed:
    moved = lines.moved(pose)
    merged = evolve(moved.segments, lengths(moved.segments) * lines.support, p.merging)
    ends = moved.segments.reshape(-1, 2)
    middle = ends.mean(axis=0) if len(ends) else pose[:2]
    return Placed(pose, Walls(merged.segments, merged.weights), middle, moved, None)


def _merged(laid: Sequence[Sequence[Laid]], p: JointParameters, kept: Kept) -> FloatArray:
    """Return (n, 4) the walls of all pieces that were only mapped, merged (paper, VI)."""
    mapped = [each.placed for those in laid for each in those if each.placed.walls is not None]
    walls = [each.walls for each in mapped if each.walls is not None]
    if not walls:
        return np.empty((0, 4))
    places = np.array([each.middle for each in mapped])
    return merge_all(walls, places, p.merging, kept.mergings).segments


def _simplified(
    merged: FloatArray, known: Seen, new: Seen, free: BaseGeometry, p: JointParameters
) -> tuple[LineMap, IntArray]:
    """Return the walls `known`, and the fewest that explain what is `new`, of those `merged`.

    Returns
    -------
    tuple of LineMap and IntArray
        The walls with their support, and (n,) their order, those known being the first.
    """
    found = simplify(merged, new.segments, new.support, free, p.simplification, known.segments)
    walls = np.concatenate([known.segments, found])
    wall, source = sources(walls, new.segments, p.simplification)
    count = np.bincount(wall, new.support[source], minlength=len(walls))
    count[: len(known.segments)] += known.support
    order, polyline = group_polylines(walls, p.max_gap)
    support = np.maximum(count, 1).astype(np.int64)[order]
    return LineMap(walls[order], polyline, support), order
