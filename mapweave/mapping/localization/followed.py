"""The map of a robot that only followed in a stored one: a path, and walls of others' making.

Those walls are no second witness for whoever made them. They tell where the path lies in a map that
they are found in: each component of it by one alignment, which can neither contradict nor confirm
another one.
"""

from collections.abc import Sequence
from dataclasses import replace

from mapweave.geometry import se2
from mapweave.maps import Alignment, RobotMap, SharedPlace, Submap, component_name
from mapweave.reasons import Reason, ReasonKind


def path_followed(robot_map: RobotMap) -> RobotMap | None:
    """Return what of `robot_map` a robot that only followed drove; None if it mapped.

    Only who followed has walls that belong to no path, and a path that no wall belongs to.
    """
    driven = tuple(s for s in robot_map.submaps if len(s.trajectory.scan_index))
    walls = [s for s in robot_map.submaps if len(s.map.segments)]
    if not driven or not walls or any(len(s.map.segments) for s in driven):
        return None
    return replace(robot_map, submaps=driven, marks=())


def joined_by(
    alignments: Sequence[Alignment], followed: RobotMap, path: RobotMap
) -> list[Alignment]:
    """Return the `alignments`, those of a map that was `followed` held by its `path`.

    Of those of a component that were accepted, the surest is left; one that the path is not in has
    none.
    """
    firsts: dict[str, Submap] = {}
    for submap in path.submaps:
        firsts.setdefault(component_name(path.robot, submap.component), submap)
    unused = {component_name(followed.robot, c) for c in followed.components} - set(firsts)
    left = [a for a in alignments if not unused & {a.reference, a.other}]
    for name, submap in firsts.items():
        about = [a for a in left if name in (a.reference, a.other) and a.decision == "accepted"]
        surest = max(about, key=lambda a: a.confidence, default=None)
        left = [a for a in left if a is surest or a not in about]
        if surest is not None:
            left[left.index(surest)] = on_path(surest, name, followed, submap)
    return left


def on_path(found: Alignment, name: str, followed: RobotMap, submap: Submap) -> Alignment:
    """Return what was `found` of a wall of the stored map, held by a stretch of the path."""
    found = replace(found, cause=Reason(ReasonKind.FOLLOWED, found=found.cause))
    poses = {s.id: s.pose for s in followed.submaps}
    for place in found.places[:1]:
        own = place.reference if name == found.reference else place.other
        here = se2.between(poses[own], submap.pose)
        if name == found.reference:
            transform = se2.compose(se2.inverse(here), place.transform)
            held = SharedPlace(submap.id, place.other, transform, place.at)
        else:
            transform = se2.compose(place.transform, here)
            held = SharedPlace(place.reference, submap.id, transform, place.at)
        return replace(found, places=(held,))
    return found
