#!/usr/bin/env bash
# pyrplidar 0.1.2: in the dense mode each distance is read with its two bytes exchanged.
#
# Expected: `start_scan_express` takes what the sensor answers with and knows three kinds of packets.
# In a dense one (0x85, as in DenseBoost of the C1) 40 distances follow a start angle, 16 bits each,
# in mm, low byte first, as all numbers of this protocol are. A wall is the same in each mode.
#
# What happens: the angle is read low byte first, the distances high byte first: 4000 mm (A0 0F)
# becomes 40975 mm. A millimetre further is 256 mm further, and after 256 mm it begins anew: a smooth
# wall is a cloud from 0 to 65 m. Nothing is raised. Angles and turns are right, and in the express
# mode (0x82) the same program reads well, so it looks like a sensor that is bad in one mode.
#
# Seen (a wall 4 m away, true ranges 4000 to 4059 mm):
#   express     4000 to  4037 mm
#   dense      40975 to 56079 mm
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q --disable-pip-version-check --no-cache-dir \
    pyrplidar==0.1.2 pyserial==3.5
"$work/venv/bin/python" - <<'EOF'
import math
import struct
import sys
from functools import reduce
from itertools import islice
from operator import xor

import pyrplidar

WALL = [round(4000 / math.cos(math.radians(k / 4))) for k in range(40)]  # [mm]


def framed(first, data):
    """A packet: two halves of a checksum with the sync bits, the start angle in 64ths of a degree."""
    body = struct.pack("<H", first * 64) + data
    check = reduce(xor, body)
    return bytes([0xA0 | check & 0xF, 0x50 | check >> 4]) + body


def dense(first):
    return framed(first, struct.pack("<40H", *WALL))


def express(first):
    pairs = zip(WALL[0:32:2], WALL[1:32:2], strict=True)
    return framed(first, b"".join(struct.pack("<HHB", a << 2, b << 2, 0) for a, b in pairs))


class Sensor:
    def __init__(self, kind, packets):
        self.sent = bytes([0xA5, 0x5A]) + struct.pack("<LB", 84 | 1 << 30, kind) + packets

    def send_data(self, _):
        pass

    def receive_data(self, size):
        data, self.sent = self.sent[:size], self.sent[size:]
        return data

    def close(self):
        pass


def read(name, kind, packets, count):
    lidar = pyrplidar.PyRPlidar()
    lidar.lidar_serial = Sensor(kind, packets)
    seen = [m.distance for m in islice(lidar.start_scan_express(0)(), count)]
    print(f"{name:7}  {min(seen):7.0f} to {max(seen):5.0f} mm")
    return seen


plain = read("express", 0x82, express(0) + express(8), 32)
swapped = read("dense", 0x85, dense(0) + dense(10), 40)
exchanged = [(d & 0xFF) << 8 | d >> 8 for d in WALL]
sys.exit(0 if plain == WALL[:32] and swapped == exchanged else 1)
EOF
