"""Pairs of robots and runs: who compares their maps, which of two comparisons or runs is older.

A run is named like its robot. Where two runs of a robot have components of the same numbers, as
those of two machines with one id, both are named by their boots as well: ``r1@BOOT/0``.
"""

import zlib
from collections.abc import Iterable
from dataclasses import replace
from typing import TypeAlias

from mapweave.maps import RobotMap
from mapweave_protocol.wire.alignment_message import MapVersion

Run: TypeAlias = tuple[str, str]  # robot and boot


def ordered(a: str, b: str) -> tuple[str, str]:
    """Return two robots as reference and other, the same whoever asks."""
    return (a, b) if a <= b else (b, a)


def responsible(a: str, b: str) -> str:
    """Return the one of two robots that compares their maps; a checksum spreads the work."""
    pair = ordered(a, b)
    return pair[zlib.crc32("/".join(pair).encode()) % 2]


def states_of(ends: Iterable[MapVersion]) -> dict[Run, int]:
    """Return the version of the map of each run that was compared."""
    return {(end.robot, end.boot): end.version for end in ends}


def is_older(one: Iterable[MapVersion], another: Iterable[MapVersion]) -> bool:
    """Tell whether `one` is of maps of the same runs of which none is newer, one older."""
    now, before = states_of(one), states_of(another)
    if now.keys() != before.keys():
        return False
    steps = [now[run] - before[run] for run in now]
    return max(steps) <= 0 and min(steps) < 0


def run_of(source: RobotMap | MapVersion) -> Run:
    """Return which run a map, or a state of it, is of."""
    return source.robot, source.boot


def clash(one: RobotMap, another: RobotMap) -> bool:
    """Tell whether two runs of a robot have components of the same numbers."""
    if one.robot != another.robot or one.boot == another.boot:
        return False
    return not set(one.components).isdisjoint(another.components)


def name_with_boot(run: Run) -> str:
    """Return what a run is named where its robot's id does not tell it from another."""
    return "@".join(run)


def with_boots(robot_map: RobotMap) -> RobotMap:
    """Return `robot_map`, its components named by the boot as well."""
    return replace(robot_map, robot=name_with_boot(run_of(robot_map)))


def told_apart(one: RobotMap, another: RobotMap) -> tuple[RobotMap, RobotMap]:
    """Return two maps, their components named so that no two names are the same."""
    return (with_boots(one), with_boots(another)) if clash(one, another) else (one, another)


def is_earlier_run(one: RobotMap, another: RobotMap) -> bool:
    """Tell whether `one` is of an earlier run of the robot of `another`, or of one without a map.

    A run numbers its components above those of the runs before it.
    """
    if one.boot == another.boot or not another.submaps:
        return False
    return not one.submaps or max(one.components) < min(another.components)
