"""Where anchors are in a robot's map, and which anchor is next to a place."""

from collections.abc import Iterable, Sequence

import numpy as np

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.maps import RobotMap, Submap, component_name
from mapweave.marks import Anchor, Mark, PlacedMark


def find(submaps: Iterable[Submap], anchor: Anchor) -> tuple[Submap, FloatArray] | None:
    """Return the submap that `anchor` is in by now and its (3,) pose there [m, m, rad].

    None where it is in none of `submaps`.
    """
    for submap in submaps:
        if anchor.scan is None:
            if submap.id == anchor.submap:
                return submap, se2.IDENTITY
            continue
        [places] = np.nonzero(submap.trajectory.scan_index == anchor.scan)
        if len(places):
            return submap, submap.trajectory.pose[places[0]]
    return None


def anchored(
    submaps: Sequence[Submap], component: int, position: FloatArray
) -> tuple[Anchor, FloatArray] | None:
    """Return the anchor next to a place, and the place in its frame; None in an empty component.

    Parameters
    ----------
    position
        (2,) [m] in the frame of `component`.

    Returns
    -------
    anchor
        The nearest scan; of submaps without scans the nearest submap.
    position
        (2,) [m] in the anchor's frame.
    """
    inside = [submap for submap in submaps if submap.component == component]
    candidates = [(submap, *_nearest(submap, position)) for submap in inside]
    if not candidates:
        return None
    submap, pose, scan, _ = min(
        candidates, key=lambda candidate: (candidate[2] is None, candidate[3])
    )
    place = se2.transform_points(se2.inverse(pose), position)
    return Anchor(submap.id, scan), place


def _nearest(submap: Submap, position: FloatArray) -> tuple[FloatArray, int | None, float]:
    """Return pose (3,) in the component and index of the scan nearest to a place, and how near."""
    path = submap.trajectory
    if not len(path.scan_index):
        return submap.pose, None, float(np.hypot(*(submap.pose[:2] - position)))
    poses = se2.compose(submap.pose, path.pose)
    apart = np.hypot(*(poses[:, :2] - position).T)
    k = int(apart.argmin())
    return poses[k], int(path.scan_index[k]), float(apart[k])


def placed_marks(robot_map: RobotMap) -> list[PlacedMark]:
    """Return the marks of a robot's map that have a place, each in its component's frame.

    A mark has none while the scan that holds it is in no submap: it came before its map.
    """
    found = ((mark, find(robot_map.submaps, mark.anchor)) for mark in robot_map.marks)
    return [
        placed(mark, robot_map.robot, held[0], se2.compose(held[0].pose, held[1]))
        for mark, held in found
        if held is not None
    ]


def placed(mark: Mark, robot: str, submap: Submap, pose: FloatArray) -> PlacedMark:
    """Return `mark` where the (3,) `pose` of its anchor, in `submap` of `robot`, puts it."""
    return PlacedMark(
        mark.id,
        mark.label,
        mark.by,
        mark.time,
        component_name(robot, submap.component),
        se2.transform_points(pose, mark.position),
    )


def tied(
    ours: Sequence[Submap], theirs: Sequence[Submap], transform: FloatArray
) -> tuple[Anchor, Anchor, FloatArray]:
    """Return what ties two components together where they are nearest, if they lie as given.

    Parameters
    ----------
    ours, theirs
        Their submaps, some of each.
    transform
        (3,) takes coordinates in their component to coordinates in ours [m, m, rad].

    Returns
    -------
    ours, theirs
        An anchor in the nearest submaps.
    transform
        (3,) from the frame of their submap to that of ours [m, m, rad]: it stays, whatever becomes
        of the submaps' poses.
    """
    here = np.array([_middle(submap) for submap in ours])
    there = se2.transform_points(transform, np.array([_middle(submap) for submap in theirs]))
    apart = np.hypot(*(here[:, None] - there[None]).transpose(2, 0, 1))
    i, j = (int(k) for k in np.unravel_index(int(apart.argmin()), apart.shape))
    other = se2.compose(transform, theirs[j].pose)
    return anchor_of(ours[i]), anchor_of(theirs[j]), se2.between(ours[i].pose, other)


def anchor_of(submap: Submap) -> Anchor:
    """Return an anchor in the middle of a submap's path."""
    scans = submap.trajectory.scan_index
    return Anchor(submap.id, int(scans[len(scans) // 2]) if len(scans) else None)


def _middle(submap: Submap) -> FloatArray:
    """(2,) of its path, or else its origin [m], component's frame."""
    path = submap.trajectory.pose[:, :2]
    middle = path[len(path) // 2] if len(path) else np.zeros(2)
    return se2.transform_points(submap.pose, middle)
