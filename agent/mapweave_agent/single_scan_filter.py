"""Scans that fit nothing, not even the next ones: nobody hears of them."""

from collections import Counter
from dataclasses import replace

from mapweave.maps import RobotMap


def without_strays(robot_map: RobotMap) -> RobotMap:
    """Return `robot_map` less the components of a single scan, unless there is no other.

    Where the robot was then is known to nothing. Peers would compare it, and the team's map would
    show it, for good. One of no scan at all is of a stored map.
    """
    scans: Counter[int] = Counter()
    for submap in robot_map.submaps:
        scans[submap.component] += len(submap.trajectory.scan_index)
    placed = tuple(s for s in robot_map.submaps if scans[s.component] != 1)
    return replace(robot_map, submaps=placed) if placed else robot_map
