"""Pairs of robots and runs: who compares their maps, which of two comparisons or runs is older."""

import zlib
from collections.abc import Iterable
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


def is_earlier_run(one: RobotMap, another: RobotMap) -> bool:
    """Tell whether `one` is of an earlier run of the robot of `another`, or of one without a map.

    A run numbers its components above those of the runs before it.
    """
    if one.boot == another.boot or not another.submaps:
        return False
    return not one.submaps or max(one.components) < min(another.components)
