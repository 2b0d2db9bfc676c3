"""The joint map: components aligned along accepted alignments, and merged (paper, VI to VIII)."""

import itertools
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from mapweave.config import Config
from mapweave.errors import ArgumentError
from mapweave.fusion.align import FusionParameters, align
from mapweave.geometry.arguments import as_list, check_kind
from mapweave.maps import Alignment, JointMap, LineMap, MadeWith, RobotMap, submaps_by_component
from mapweave.team.alignment_graph import cluster_components
from mapweave.team.joining import JointParameters, Piece, join
from mapweave.team.joint_builder import JointMapBuilder, rasterise, testify
from mapweave.team.joint_optimization import JointOptimizationParameters


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
    builder = JointMapBuilder(
        JointParameters.of(config), JointOptimizationParameters.of(config, newest=True)
    )
    joint = builder.build(maps, alignments, 1, patient=True)
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
) -> JointMap:
    """Return `components` (by name, such as ``a/0``) joined and merged, each of them rigid.

    Alignments that contradict others, or what robots saw, are set aside: they stay in the joint
    map as ambiguous, the reason saying so.
    """
    p = parameters or JointParameters()
    found = {name: rasterise(lines, p) for name, lines in components.items()}
    rasters = {name: raster for name, raster in found.items() if raster is not None}
    clusters, judged = cluster_components(sorted(components), alignments, p.graph, rasters)
    pieces = {
        name: [Piece(lines, testify(found[name], p), np.zeros(3))]
        for name, lines in components.items()
    }
    return JointMap(version, tuple(join(each, pieces, p) for each in clusters), judged)
