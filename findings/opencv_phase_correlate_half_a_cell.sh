#!/usr/bin/env bash
# OpenCV 5.0.0: for one size in eight phaseCorrelate tells of a grid that it is half a cell off itself.
#
# Expected: `phaseCorrelate` finds by what two images are shifted, to parts of a pixel. One
# and the same grid has no shift; a wall that was drawn five cells further has one of five.
#
# What happens: images are padded to a size at which the FFT is fast. The peak is moved to the middle of
# that size, for an odd one the centre of a cell; the shift is then counted from half the size, which
# lies between two cells. So half a cell is added in x where the padded width is odd, in y where the
# height is, with a response of 1.0, as sure as can be. The image's own size need not be odd. At 5 cm
# a cell all shifts are off by 2.5 cm, always the same way: a map that is moved by each wanders off.
# Who tests with 256 or 512 cells sees nothing, and a window changes nothing.
#
# Seen (a room of walls, the second time 5 cells further in x and 3 in y):
#   size   padded to    by itself         moved
#    220         225     0.50   0.50   5.50   3.50
#    240         240     0.00   0.00   5.00   3.00
#    401         405     0.50   0.50   5.50   3.50
#    512         512     0.00   0.00   5.00   3.00
#   of the sizes from 100 to 1000 cells 12% are padded to an odd one
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q --disable-pip-version-check --no-cache-dir \
    opencv-python-headless==5.0.0.93 numpy==2.4.6
"$work/venv/bin/python" - <<'EOF'
import sys

import cv2
import numpy as np

MOVE = 5, 3  # [cells] in x and y


def room(size, dx=0, dy=0):
    """Return a grid with the walls of a room with two doors, and a pillar."""
    grid = np.zeros((size, size), np.float32)
    low, high = 40, size - 50
    for (x1, y1), (x2, y2) in (
        ((low, low), (high, low)),
        ((low, low), (low, 90)),
        ((low, 120), (low, high)),
        ((low, high), (100, high)),
        ((130, high), (high, high)),
        ((high, low), (high, high)),
        ((80, 95), (88, 95)),
    ):
        cv2.line(grid, (x1 + dx, y1 + dy), (x2 + dx, y2 + dy), 1.0, 3)
    return grid


ok = True
print("size   padded to    by itself         moved")
for size in (220, 240, 401, 512):
    padded = cv2.getOptimalDFTSize(size)
    still, sure = cv2.phaseCorrelate(room(size), room(size))
    moved, _ = cv2.phaseCorrelate(room(size), room(size, *MOVE))
    shifts = "".join(f"{abs(shift):7.2f}" for shift in (*still, *moved))
    print(f"{size:4} {padded:11}  {shifts}")
    bias = 0.5 * (padded % 2)
    ok &= np.allclose(still, bias, atol=0.01) and sure > 0.99
    ok &= np.allclose(moved, np.add(MOVE, bias), atol=0.15)
odd = np.mean([cv2.getOptimalDFTSize(size) % 2 for size in range(100, 1001)])
print(f"of the sizes from 100 to 1000 cells {odd:.0%} are padded to an odd one")
sys.exit(0 if ok and 0.1 < odd < 0.5 else 1)
EOF
