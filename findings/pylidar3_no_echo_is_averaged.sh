#!/usr/bin/env bash
# PyLidar3 1.6: beams without an echo count as 0 m: the wall of a degree comes nearer.
#
# Expected: a YDLIDAR X4 sends 0 where no echo came (glass, black, too far). `StartScanning` gives one
# distance for each degree, from all samples of six turns that fall into it, about eight. A sample
# that says "nothing measured" is left out, and a degree in which no beam came back is 0.
#
# What happens: all samples of a degree are averaged, the zeros as well. Where every second one had
# no echo, the distance is half of the true one: a point in the free room, which no filter for 0
# finds and which looks like any other. With one beam in ten without an echo, half of all degrees
# are too near, some by half, and none is too far: more scans do not average it out.
#
# Seen (a round room of 4 m, each echo exact):
#   all beams return       0 of 360 degrees between 0 and 4 m
#   1 in 10 has no echo  187 of 360 degrees between 0 and 4 m, the nearest at 2.00 m
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q --disable-pip-version-check --no-cache-dir \
    PyLidar3==1.6 pyserial==3.5
"$work/venv/bin/python" - <<'EOF'
import random
import struct
import sys
from functools import reduce
from operator import xor

import PyLidar3

SAMPLES = 40  # of a packet; twelve packets a turn
ANSWERS = {b"\xa5\x91": "a55a0300000006000000", b"\xa5\x60": "a55a0500004081"}


def packet(ranges, first, last, kind=0):
    """A packet of the X4: angles [deg] as 64ths, ranges [mm] as quarters, and a checksum."""
    head = [kind | len(ranges) << 8, int(first * 64) << 1 | 1, int(last * 64) << 1 | 1]
    data = [4 * value for value in ranges]
    check = reduce(xor, head + data, 0x55AA)
    return struct.pack(f"<{5 + len(data)}H", 0x55AA, *head, check, *data)


class Sensor:
    """What the X4 sends: answers to commands, then turns without end."""

    measure = None

    def __init__(self, *_):
        self.sent = b""

    def write(self, command):
        self.sent = bytes.fromhex(ANSWERS.get(command, ""))

    def read(self, size):
        while len(self.sent) < size and (size > 100 or not self.sent):
            self.sent += packet([self.measure()], 0, 0, 1)
            for first in range(0, 360, 30):
                ranges = [self.measure() for _ in range(SAMPLES)]
                self.sent += packet(ranges, first, first + 29.25)
        data, self.sent = self.sent[:size], self.sent[size:]
        return data

    def setDTR(self, _):
        pass

    def reset_input_buffer(self):
        self.sent = b""


PyLidar3.Serial = Sensor
PyLidar3.sleep = lambda _: None


def phantoms(name, share):
    rng = random.Random(1)
    Sensor.measure = lambda _: 0 if rng.random() < share else 4000
    lidar = PyLidar3.YdLidarX4("port")
    assert lidar.Connect()
    ranges = next(lidar.StartScanning()).values()
    near = [value for value in ranges if 0 < value < 4000]
    assert max(ranges) == 4000
    least = f", the nearest at {min(near) / 1000:.2f} m" if near else ""
    print(f"{name:19}  {len(near):3} of 360 degrees between 0 and 4 m{least}")
    return len(near)


seen = [phantoms("all beams return", 0.0), phantoms("1 in 10 has no echo", 0.1)]
sys.exit(0 if seen[0] == 0 and seen[1] > 120 else 1)
EOF
