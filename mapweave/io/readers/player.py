"""Lines of Player's logs that hold a scan: its ``laser`` interface.

::

    time host robot laser index 001 001  scan_id
        min_angle max_angle resolution max_range n r1 i1…rn in
    time host robot laser index 001 002  scan_id x y theta
        min_angle max_angle resolution max_range n r1 i1…rn in

as the documentation of Player's ``writelog`` has them; the pose is the robot's.
"""

import numpy as np

from mapweave.geometry.arrays import FloatArray
from mapweave.io.readers.beams import stated_beams
from mapweave.io.readers.records import (
    LaserRecord,
    check_length,
    parse_count,
    parse_numbers,
    parse_stamp,
    without_no_returns,
)

_HEAD = 8  # words up to the scan's number, included
_UNKNOWN: FloatArray = np.full(3, np.nan)


def is_player(words: list[bytes]) -> bool:
    """Return whether the words are those of a line of a Player log, of whatever interface."""
    return (
        len(words) >= 7
        and words[3].isalnum()
        and words[3][:1].isalpha()
        and all(words[place].isdigit() for place in (1, 2, 5, 6))
    )


def parse_player(words: list[bytes]) -> LaserRecord | None:
    """Return the scan of a line of a Player log; None if it holds none.

    Raises
    ------
    DamagedLineError
        If a word is missing, left over, or not the number it should be.
    """
    if words[3] != b"laser" or int(words[5][:9]) != 1:
        return None
    kind = int(words[6][:9])
    if kind not in (1, 2):
        return None
    after = _HEAD + (3 if kind == 2 else 0)
    count = parse_count(words, after + 4, "beams")
    check_length(words, (after + 5 + 2 * count,))
    low, high, resolution, maximum = parse_numbers(words[after : after + 4])
    beams = stated_beams(float(low), float(high - low), float(resolution), count)
    readings = parse_numbers(words[after + 5 :])[::2]
    return LaserRecord(
        angles=beams.angles,
        ranges=without_no_returns(beams.ascending(readings), float(maximum)),
        laser_pose=_UNKNOWN,
        robot_pose=parse_numbers(words[_HEAD:after]) if kind == 2 else _UNKNOWN,
        stamp=parse_stamp(words[0]),
        assumed=beams.assumed,
    )
