#!/usr/bin/env bash
# pysicktim 0.0.9: distances are told without the telegram's own factor, its scan frequency in base 32.
#
# Expected: a scan telegram of SICK's (`LMDscandata`) is text whose numbers are hexadecimal. Before the distances
# stands what one step is worth: 3F800000 is 1 as a float of 32 bits, 40000000 is 2, which scanners that
# see beyond 65 m or were set so send. `scan()` gives `distances` in metres, and `scan_freq` in hertz.
#
# What happens: the factor is read as a whole number, stored, and never applied: with 2 a wall 4 m away is told at
# 2 m, a room at half its size, straight and square. Some fields are read with base 32 for 16: 5DC, 15 Hz, is
# told as 55 Hz, so a sweep of 67 ms is taken for one of 18 ms, and clocks in the telegram run wrongly. With
# the factor 1, as this program's own sample has it, distances are right. Nothing is raised.
#
# Seen (a wall of three beams 4 m away, a scanner at 15 Hz):
#   factor 1: distances 4.0 4.0 4.0   55.48 Hz
#   factor 2: distances 2.0 2.0 2.0   55.48 Hz
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q --disable-pip-version-check --no-cache-dir \
    pysicktim==0.0.9 pyusb==1.3.1
"$work/venv/bin/python" - <<'EOF'
import struct
import sys

import usb.core

WALL = 4.0  # [m]


def telegram(factor):
    """A scan of three beams from -45 degrees on, a degree apart, taken 15 times a second."""
    steps = [round(1000 * WALL / factor)] * 3
    value = struct.pack(">f", factor).hex().upper()
    head = "sRA LMDscandata 1 1 89A27F 0 0 343 347 27477BA9 2747813B 0 0 7 0 0 5DC 168 0 1"
    channel = f"DIST1 {value} 00000000 FFF92230 2710 {len(steps):X}"
    data = " ".join(f"{step:X}" for step in steps)
    return f"{head} {channel} {data} 0 0 0 0 0 0"


class Scanner:
    """A device that takes each request and answers with one telegram, in its frame of STX and ETX."""

    def __init__(self):
        self.answer = ""

    def write(self, *_):
        pass

    def read(self, *_, **__):
        return b"\x02" + self.answer.encode() + b"\x03"


scanner = Scanner()
usb.core.find = lambda **_: scanner  # no scanner is plugged in here

from pysicktim import pysicktim  # noqa: E402 - looks for its scanner as it is imported

told = {}
for factor in (1.0, 2.0):
    scanner.answer = telegram(factor)
    pysicktim.scan()
    told[factor] = list(pysicktim.scan.distances)
    print(f"factor {factor:.0f}: distances", *told[factor], f"  {pysicktim.scan.scan_freq} Hz")
right, half = told[1.0] == [WALL] * 3, told[2.0] == [WALL / 2] * 3
sys.exit(0 if right and half and pysicktim.scan.scan_freq > 50 else 1)
EOF
