"""One component of a joint map: the walls of all that was joined, merged (paper, VI and VII)."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from shapely.geometry.base import BaseGeometry

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray, IntArray
from mapweave.geometry.segments import lengths
from mapweave.lines.merging import MergingParameters, evolve
from mapweave.lines.polylines import group_polylines
from mapweave.lines.simplification import SimplificationParameters, simplify, sources
from mapweave.maps import JointComponent, LineMap
from mapweave.matching.distance_field import DistanceField, DistanceFieldParameters
from mapweave.parameters import StageParameters, derived
from mapweave.scan.free_space import FreeSpaceParameters, rings, unite
from mapweave.team.alignment_graph import AlignmentGraphParameters, Cluster
from mapweave.team.segment_confidence import SegmentConfidenceParameters, segment_confidence


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
    raster
        Of them; None where no wall was seen.
    pose
        (3,) of their frame in the component's [m, m, rad].
    """

    lines: LineMap
    raster: DistanceField | None
    pose: FloatArray


def join(
    cluster: Cluster, pieces: Mapping[str, Sequence[Piece]], p: JointParameters
) -> JointComponent:
    """Return the components of `cluster`, each of its `pieces`, as one.

    What there is to be known of a piece that does not change was worked out before: of where it
    lies now depends only what is done here.
    """
    placed = {
        name: [(piece, se2.compose(frame, piece.pose)) for piece in pieces[name]]
        for name, frame in cluster.poses.items()
    }
    everything = [each for those in placed.values() for each in those]
    seen = np.concatenate(
        [
            np.empty((0, 4)),
            *(se2.transform_segments(t, one.lines.segments) for one, t in everything),
        ]
    )
    support: IntArray = np.concatenate(
        [np.empty(0, dtype=np.int64), *(one.lines.support for one, _ in everything)]
    )
    free = unite([ring for one, t in everything for ring in _free_space(one, t)], p.free_space)
    lines = _merged(seen, support, free, p)
    views = [
        [(one.raster, t) for one, t in those if one.raster is not None] for those in placed.values()
    ]
    sure = segment_confidence(lines, views, p.segments)
    return JointComponent(cluster.poses, cluster.confidence, lines, sure)


def _free_space(piece: Piece, pose: FloatArray) -> list[FloatArray]:
    """Return the rings of the free space of `piece` where it lies, moved all at once."""
    outlines = piece.lines.free_space
    if not outlines:
        return []
    ends = np.cumsum([len(ring) for ring in outlines])
    return np.split(se2.transform_points(pose, np.concatenate(outlines)), ends[:-1])


def _merged(seen: FloatArray, support: IntArray, free: BaseGeometry, p: JointParameters) -> LineMap:
    """Return the walls of all pieces, (n, 4) `seen`, merged (paper, VI) and simplified."""
    merged = evolve(seen, lengths(seen) * support, p.merging).segments
    walls = simplify(merged, seen, support, free, p.simplification)
    wall, source = sources(walls, seen, p.simplification)
    count = np.bincount(wall, support[source], minlength=len(walls))
    order, polyline = group_polylines(walls, p.max_gap)
    known = np.maximum(count, 1).astype(np.int64)[order]
    return LineMap(walls[order], polyline, known, rings(free))
