"""The joint map: components aligned along accepted alignments, and merged (paper, VI to VIII)."""

from collections.abc import Mapping, Sequence

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from mapweave.alignment_graph import Cluster, GraphParameters, cluster_components
from mapweave.arrays import FloatArray
from mapweave.assembly import place, unite_lines
from mapweave.free_space import FreeSpaceParameters, from_rings, rings, unite
from mapweave.map_raster import MapRaster, RasterParameters
from mapweave.maps import Alignment, JointComponent, JointMap, LineMap
from mapweave.merging import MergingParameters, evolve
from mapweave.polylines import group_polylines
from mapweave.surface import line_surface


class JointParameters(BaseModel):
    """How robots' maps become one."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    graph: GraphParameters = GraphParameters()
    merging: MergingParameters = MergingParameters(max_step=0.25, max_cost=0.2)
    free_space: FreeSpaceParameters = FreeSpaceParameters()
    raster: RasterParameters = RasterParameters()
    max_gap: float = Field(0.5, gt=0, description="[m] within a generalized polyline")
    clearance: float = Field(
        0.3, gt=0, description="[m] inside another's free space from which a wall is doubtful"
    )


def build_joint_map(
    components: Mapping[str, LineMap],
    alignments: Sequence[Alignment],
    version: int,
    parameters: JointParameters | None = None,
) -> JointMap:
    """Return what the team knows: `components` (by name, such as ``a/0``) joined and merged.

    Alignments that contradict better ones are set aside: they stay in the joint map as
    ambiguous, the reason saying so.
    """
    p = parameters or JointParameters()
    clusters, judged = cluster_components(sorted(components), alignments, p.graph)
    joined = tuple(_join(cluster, components, p) for cluster in clusters)
    return JointMap(version, joined, judged)


def _join(
    cluster: Cluster, components: Mapping[str, LineMap], p: JointParameters
) -> JointComponent:
    placed = [place(components[name], pose) for name, pose in cluster.poses.items()]
    everything = unite_lines(placed)
    lengths = np.hypot(*(everything.segments[:, 2:] - everything.segments[:, :2]).T)
    merged = evolve(everything.segments, lengths * everything.support, p.merging)
    support = np.bincount(
        merged.labels, weights=everything.support, minlength=len(merged.segments)
    ).astype(np.int64)
    order, polyline = group_polylines(merged.segments, p.max_gap)
    free = rings(unite([from_rings(everything.free_space)], p.free_space))
    lines = LineMap(merged.segments[order], polyline, support[order], free)
    return JointComponent(
        cluster.poses, cluster.confidence, lines, _segment_confidence(lines, placed, p)
    )


def _segment_confidence(lines: LineMap, placed: list[LineMap], p: JointParameters) -> FloatArray:
    """(n,) in [0, 1]: more with every scan that saw it, less where a robot saw through it.

    n sightings give n / (n + 1), Laplace's rule for what was never denied; the share of the
    segment that lies well inside what some robot saw as free counts against it.
    """
    if len(lines.segments) == 0:
        return np.empty(0)
    surface, owner = line_surface(lines, p.raster.spacing)
    denied = np.zeros(len(surface), dtype=np.bool_)
    for one in placed:
        if len(one.segments) == 0:
            continue
        raster = MapRaster.of(one, p.raster)
        _, distance, depth = raster.look_up(surface.points)
        denied |= (depth > p.clearance) & (distance > p.clearance)
    share = np.bincount(owner, weights=denied) / np.bincount(owner)
    return np.asarray(lines.support / (lines.support + 1.0) * (1.0 - share))
