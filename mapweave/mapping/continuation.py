"""Going on from a stored map: its submaps come before those of the run."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.maps import RobotMap, Submap
from mapweave.marks import Mark


def to_continue(known: RobotMap | None) -> tuple[Submap, ...]:
    """Return the submaps of a map that a run goes on from, their ids from 0; none without one."""
    submaps = () if known is None else known.submaps
    return tuple(replace(submap, id=number) for number, submap in enumerate(submaps))


def marks_to_continue(known: RobotMap | None) -> tuple[Mark, ...]:
    """Return the marks of a map that a run goes on from, held by the submaps of `to_continue`."""
    if known is None:
        return ()
    number = {submap.id: k for k, submap in enumerate(known.submaps)}
    return tuple(
        replace(mark, anchor=replace(mark.anchor, submap=number.get(mark.anchor.submap, 0)))
        for mark in known.marks
        # Where a scan holds it the submap's number may be one from before it was cut.
        if mark.anchor.scan is not None or mark.anchor.submap in number
    )


def first_component(submaps: Sequence[Submap]) -> int:
    """Return the first number above the components of `submaps`."""
    return max((submap.component for submap in submaps), default=-1) + 1


def scans_in(submaps: Sequence[Submap]) -> int:
    """Return the first number above those of the scans of `submaps`."""
    return max((int(s.trajectory.scan_index.max(initial=-1)) for s in submaps), default=-1) + 1


def links_to_keep(submaps: Sequence[Submap], near: float) -> Iterator[tuple[Submap, Submap]]:
    """Yield the pairs of a component, the older first, that follow each other or are `near` [m].

    So that all of a component hangs together, and bends no more easily than when it was mapped.
    """
    for component in sorted({s.component for s in submaps}):
        inside = [s for s in submaps if s.component == component]
        followers = {(a.id, b.id) for a, b in pairwise(inside)}
        middles = {s.id: _middle(s) for s in inside}
        for k, first in enumerate(inside):
            for second in inside[k + 1 :]:
                apart = math.dist(middles[first.id], middles[second.id])
                if apart <= near or (first.id, second.id) in followers:
                    yield first, second


def _middle(submap: Submap) -> FloatArray:
    """(2,) of a submap's path, or of its walls where it has none, component frame [m]."""
    path, walls = submap.trajectory.pose[:, :2], submap.map.segments.reshape(-1, 2)
    points = path if len(path) else walls
    return se2.transform_points(submap.pose, points.mean(axis=0) if len(points) else np.zeros(2))
