#!/usr/bin/env bash
# lds2d 0.7.0: one turn of a YDLIDAR comes as several scans where beams ahead have no echo.
#
# Expected: `scans()` gives one scan a turn. The sensor itself says where a turn begins: a bit in
# the packet's type, which the driver reads (for the frequency).
#
# What happens: a scan is cut where the angle falls by more than 180 degrees from one point to the
# next. Angles of a YDLIDAR are corrected by distance, by -8 degrees for a wall and by 0 for a beam
# without an echo. Just behind the start of a turn those with an echo are still at 352 to 360
# degrees, those without at 0 to 8, and each change from one to the other falls by some 350: a scan
# of two points. A grating, a plant or a glass door ahead makes several scans of a turn. All but one
# are next to nothing, for a matcher that expects a room; the rate seems to be six times the true one.
#
# Seen (5 turns of 481 points; walls 3 m away all around):
#   all beams return      5 scans,  0 of them of less than 10 points
#   glass, 3 beams       10 scans,  5 of them of less than 10 points
#   a grating, 8 deg     30 scans, 25 of them of less than 10 points
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q --disable-pip-version-check --no-cache-dir \
    lds2d==0.7.0 pyserial==3.5
"$work/venv/bin/python" - <<'EOF'
import struct
import sys
from functools import reduce
from operator import xor

from lds2d import Lidar

TURNS, STEP = 5, 0.75  # [deg] from beam to beam


def packet(ranges, first, last, kind=0):
    """A packet of the X4: angles [deg] as 64ths, ranges [mm] as quarters, and a checksum."""
    head = [kind | len(ranges) << 8, int(first * 64) << 1 | 1, int(last * 64) << 1 | 1]
    data = [4 * value for value in ranges]
    check = reduce(xor, head + data, 0x55AA)
    return struct.pack(f"<{5 + len(data)}H", 0x55AA, *head, check, *data)


def turn(measure):
    packets = [packet([measure(0)], 0, 0, 1)]
    for first in range(0, 360, 30):
        ranges = [measure(first / STEP + k) for k in range(40)]
        packets.append(packet(ranges, first, first + 39 * STEP))
    return b"".join(packets)


class Port:
    def __init__(self, sent):
        self.sent = sent

    def read(self, size):
        if not self.sent:
            raise EOFError
        data, self.sent = self.sent[:size], self.sent[size:]
        return data


def scans(name, measure):
    lidar, sizes = Lidar.open("YDLIDAR-X4", transport=Port(TURNS * turn(measure))), []
    try:
        for scan in lidar.scans():
            sizes.append(len(scan))
    except EOFError:
        small = sum(size < 10 for size in sizes[1:])
        print(f"{name:19}  {len(sizes):2} scans, {small:2} of them of less than 10 points")
    return len(sizes), small


seen = [
    scans("all beams return", lambda beam: 3000),
    scans("glass, 3 beams", lambda beam: 0 if 3 <= beam < 6 else 3000),
    scans("a grating, 8 deg", lambda beam: 0 if beam < 11 and beam % 2 else 3000),
]
sys.exit(0 if seen == [(TURNS, 0), (2 * TURNS, TURNS), (6 * TURNS, 5 * TURNS)] else 1)
EOF
