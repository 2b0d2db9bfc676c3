"""One component of a joint map: the walls of all that was joined, merged (paper, VI and VII)."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple, TypeAlias

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
from mapweave.scan.free_space import FreeSpaceParameters, rings, unite
from mapweave.team.alignment_graph import AlignmentGraphParameters, Cluster
from mapweave.team.recent import Recent
from mapweave.team.walls.merging_tree import KnownMergings, Walls, merge_all
from mapweave.team.walls.segment_confidence import (
    SegmentConfidenceParameters,
    Witness,
    segment_confidence,
)

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
    """

    lines: LineMap
    witness: Witness | None
    pose: FloatArray


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
        Its segments, merged.
    seen
        (n, 4) its segments [m] as they are.
    free_space
        Its rings.
    """

    pose: FloatArray
    walls: Walls
    seen: FloatArray
    free_space: tuple[FloatArray, ...]


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
    # Gone through every time, so that what was merged is kept as well.
    merged = _merged([[each.placed.walls for each in those] for those in laid], p, kept)
    lines, sure = kept.joined.get(laid, lambda: _joined(laid, merged, p))
    return JointComponent(cluster.poses, cluster.confidence, lines, sure)


def _joined(laid: Sequence[Sequence[Laid]], merged: FloatArray, p: JointParameters) -> Joined:
    """Return the walls of all pieces, of which (n, 4) are left when `merged`."""
    together = [each for those in laid for each in those]
    seen = np.concatenate([np.empty((0, 4)), *(each.placed.seen for each in together)])
    support: IntArray = np.concatenate(
        [np.empty(0, dtype=np.int64), *(each.lines.support for each in together)]
    )
    free = unite([ring for each in together for ring in each.placed.free_space], p.free_space)
    lines = _simplified(merged, seen, support, free, p)
    views = [
        [(each.witness, each.placed.pose) for each in those if each.witness is not None]
        for those in laid
    ]
    return lines, segment_confidence(lines, views, p.segments)


def _placed(piece: Piece, frame: FloatArray, p: JointParameters, kept: Kept) -> Placed:
    """Lay `piece` down in the component that is at `frame` (3,)."""
    steps = np.round(se2.compose(frame, piece.pose) / STEPS).astype(np.int64)
    key = piece.lines, tuple(steps.tolist())
    return kept.placed.get(key, lambda: _laid_down(piece.lines, steps * STEPS, p))


def _laid_down(lines: LineMap, pose: FloatArray, p: JointParameters) -> Placed:
    moved = lines.moved(pose)
    merged = evolve(moved.segments, lengths(moved.segments) * lines.support, p.merging)
    return Placed(pose, Walls(merged.segments, merged.weights), moved.segments, moved.free_space)


def _merged(walls: Sequence[Sequence[Walls]], p: JointParameters, kept: Kept) -> FloatArray:
    """Return (n, 4) the walls of all pieces, of those of each component first (paper, VI)."""
    each = [merge_all(those, p.merging, kept.mergings) for those in walls if those]
    if not each:
        return np.empty((0, 4))
    return merge_all(each, p.merging, kept.mergings).segments


def _simplified(
    merged: FloatArray, seen: FloatArray, support: IntArray, free: BaseGeometry, p: JointParameters
) -> LineMap:
    """Return the fewest walls that explain (n, 4) `seen`, of those `merged`, with their support."""
    walls = simplify(merged, seen, support, free, p.simplification)
    wall, source = sources(walls, seen, p.simplification)
    count = np.bincount(wall, support[source], minlength=len(walls))
    order, polyline = group_polylines(walls, p.max_gap)
    known = np.maximum(count, 1).astype(np.int64)[order]
    return LineMap(walls[order], polyline, known, rings(free))
