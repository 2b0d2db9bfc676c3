"""The joint map: components aligned along accepted alignments, and merged (paper, VI to VIII)."""

import itertools
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import TypeAlias

import numpy as np
from shapely.geometry.base import BaseGeometry

from mapweave.config import Config
from mapweave.errors import ArgumentError
from mapweave.fusion.align import FusionParameters, align
from mapweave.geometry.arguments import as_list, check_kind
from mapweave.geometry.arrays import FloatArray
from mapweave.geometry.segments import lengths
from mapweave.lines.merging import MergingParameters, evolve
from mapweave.lines.polylines import group_polylines
from mapweave.lines.simplification import SimplificationParameters, simplify, sources
from mapweave.maps import (
    Alignment,
    JointComponent,
    JointMap,
    LineMap,
    MadeWith,
    RobotMap,
    lines_of,
    submaps_by_component,
)
from mapweave.matching.distance_field import DistanceField, DistanceFieldParameters
from mapweave.parameters import StageParameters, derived
from mapweave.scan.free_space import FreeSpaceParameters, from_rings, rings, unite
from mapweave.team.alignment_graph import AlignmentGraphParameters, Cluster, cluster_components
from mapweave.team.joint_optimization import JointOptimizationParameters, JointOptimizer
from mapweave.team.segment_confidence import SegmentConfidenceParameters, segment_confidence

Weave: TypeAlias = Callable[[Cluster, Sequence[Alignment]], tuple[Cluster, Mapping[str, LineMap]]]


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


def fuse(
    maps: Iterable[RobotMap],
    alignments: Iterable[Alignment] | None = None,
    config: Config | None = None,
) -> JointMap:
    """Return the joint map of robots whose maps are complete: nothing grows any more.

    Parameters
    ----------
    maps
        Of one robot each.
    alignments
        As of `mapweave.align`, of any of their pairs; by default all pairs are compared here.
    config
        What the joint map is made with, and says so; by default the default one.

    Returns
    -------
    JointMap
        Version 1. Alignments that contradict others are in it, and say so; maps that no
        alignment joins stay components of their own.

    Raises
    ------
    ArgumentError
        If two maps are of one robot, an alignment names a component that no map has, or anything
        is not of its kind.

    Examples
    --------
    >>> fuse([RobotMap("a", "0", 0, ()), RobotMap("b", "0", 0, ())]).components
    ()
    """
    config = Config() if config is None else config
    check_kind("config", config, Config)
    maps = as_list("maps", maps, RobotMap)
    _check_robots(maps)
    if alignments is None:
        pairs = itertools.combinations(maps, 2)
        p = FusionParameters.of(config)
        alignments = [a for first, second in pairs for a in align(first, second, p)]
    alignments = as_list("alignments", alignments, Alignment)
    _check_components(maps, alignments)
    # Nothing grows any more, and there is no next time.
    weaver = JointOptimizer(JointOptimizationParameters.of(config, newest=True, at_once=1_000_000))
    joint = build_team_map(maps, alignments, 1, weaver, JointParameters.of(config))
    return replace(joint, made_with=MadeWith.of(config))


def _check_robots(maps: Sequence[RobotMap]) -> None:
    robots = [m.robot for m in maps]
    twice = sorted({robot for robot in robots if robots.count(robot) > 1})
    if twice:
        raise ArgumentError(
            "maps", f"expected maps of different robots, got two of robot {twice[0]!r}"
        )


def _check_components(maps: Sequence[RobotMap], alignments: Sequence[Alignment]) -> None:
    known = submaps_by_component(maps)
    for name in (name for a in alignments for name in (a.reference, a.other)):
        if name not in known:
            raise ArgumentError(
                "alignments", f"expected components of the maps, {', '.join(known)}; got {name!r}"
            )


def build_joint_map(
    components: Mapping[str, LineMap],
    alignments: Sequence[Alignment],
    version: int,
    parameters: JointParameters | None = None,
    weave: Weave | None = None,
) -> JointMap:
    """Return what the team knows: `components` (by name, such as ``a/0``) joined and merged.

    Alignments that contradict others, or what robots saw, are set aside: they stay in the joint
    map as ambiguous, the reason saying so.

    Parameters
    ----------
    weave
        Moves the submaps of a cluster to where they fit, given the alignments as they were judged;
        without it components stay rigid.
    """
    p = parameters or JointParameters()
    rasters = _rasters(components, p)
    clusters, judged = cluster_components(sorted(components), alignments, p.graph, rasters)
    joined = tuple(
        _join(cluster, components, rasters, p)
        if weave is None or len(cluster.poses) == 1
        else _join_woven(*weave(cluster, judged), p)
        for cluster in clusters
    )
    return JointMap(version, joined, judged)


def build_team_map(
    maps: Sequence[RobotMap],
    alignments: Sequence[Alignment],
    version: int,
    weaver: JointOptimizer,
    parameters: JointParameters | None = None,
) -> JointMap:
    """Return what the team knows, its robots' submaps woven together."""
    submaps = submaps_by_component(maps)
    lines = {name: lines_of(each) for name, each in submaps.items()}
    return build_joint_map(
        lines,
        alignments,
        version,
        parameters,
        weave=lambda cluster, judged: weaver.weave(cluster, submaps, judged),
    )


def _join_woven(
    cluster: Cluster, components: Mapping[str, LineMap], p: JointParameters
) -> JointComponent:
    return _join(cluster, components, _rasters(components, p), p)


def _rasters(components: Mapping[str, LineMap], p: JointParameters) -> dict[str, DistanceField]:
    """Return the rasters of those components that have seen any wall."""
    return {
        name: DistanceField.of(lines, p.raster)
        for name, lines in components.items()
        if len(lines.segments)
    }


def _join(
    cluster: Cluster,
    components: Mapping[str, LineMap],
    rasters: Mapping[str, DistanceField],
    p: JointParameters,
) -> JointComponent:
    placed = [components[name].moved(pose) for name, pose in cluster.poses.items()]
    everything = LineMap.union(placed)
    free = unite([from_rings(everything.free_space)], p.free_space)
    walls = _merged(everything, free, p)
    wall, source = sources(walls, everything.segments, p.simplification)
    support = np.bincount(wall, everything.support[source], minlength=len(walls))
    order, polyline = group_polylines(walls, p.max_gap)
    lines = LineMap(
        walls[order], polyline, np.maximum(support, 1).astype(np.int64)[order], rings(free)
    )
    views = [(rasters[name], pose) for name, pose in cluster.poses.items() if name in rasters]
    return JointComponent(
        cluster.poses, cluster.confidence, lines, segment_confidence(lines, views, p.segments)
    )


def _merged(everything: LineMap, free: BaseGeometry, p: JointParameters) -> FloatArray:
    """Return (n, 4) the walls of all submaps, merged (paper, VI) and simplified."""
    seen, support = everything.segments, everything.support
    merged = evolve(seen, lengths(seen) * support, p.merging).segments
    return simplify(merged, seen, support, free, p.simplification)
