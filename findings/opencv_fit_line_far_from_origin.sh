#!/usr/bin/env bash
# opencv-python-headless 4.12.0.88 (5.0.0.93 does the same): fitLine of points given as float64, at
# map coordinates, returns a line of another direction.
#
# Expected: least squares through points that lie exactly on a line gives that line, wherever the
# origin is. fitLine accepts arrays of float64 and takes them without complaint, and its accuracy
# parameters (0.01) are documented as those of the iterative distances only.
#
# What happens: coordinates are converted to float32, and moments are summed about the origin, not
# about the mean. Three kilometres from the origin the direction of a 10 m wall is off by 0.08
# degrees, at 10 km by half a degree, and at 100 km it slopes the other way; in UTM nothing is left
# of it. Nothing is raised, and the centre returned is right. Two walls that meet at a right angle
# in one frame do not in another. Subtract the mean first.
#
# Seen (a wall at 26.565 degrees):
#   origin at      0 m: 26.565 degrees
#   origin at   1000 m: 26.565 degrees
#   origin at   3000 m: 26.490 degrees
#   origin at  10000 m: 26.003 degrees
#   origin at 100000 m: -38.391 degrees
#   wall along y, origin at 100000 m: -3.120 degrees for 90
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q --disable-pip-version-check --no-cache-dir \
    opencv-python-headless==4.12.0.88 numpy==2.2.6
"$work/venv/bin/python" - <<'EOF'
import math
import sys

import cv2
import numpy as np

along = np.linspace(0, 10, 101)
slanted = np.column_stack([along, along / 2])
upright = np.column_stack([np.full(101, 2.0), along])


def direction(points):
    dx, dy, *_ = cv2.fitLine(points, cv2.DIST_L2, 0, 0.01, 0.01).ravel()
    return math.degrees(math.atan2(dy, dx))


print("a wall at 26.565 degrees:")
found = {}
for origin in (0, 1000, 3000, 10_000, 100_000):
    found[origin] = direction(slanted + origin)
    print(f"origin at {origin:6} m: {found[origin]:.3f} degrees")
tilted = direction(upright + 100_000)
print(f"wall along y, origin at 100000 m: {tilted:.3f} degrees for 90")
off = {origin: abs(angle - found[0]) for origin, angle in found.items()}
same = abs(found[0] - 26.565) < 0.001 and 0.01 < off[3000] < off[10_000] and off[100_000] > 10
sys.exit(0 if same and abs(abs(tilted) - 90) > 10 else 1)
EOF
