#!/usr/bin/env bash
# pyclipper 1.4.0: outlines in metres are cut to whole metres.
#
# Expected: the union of two rooms, 3.3 m and 4.7 m wide and 2.5 m deep, that overlap, is given in
# the coordinates in which they were given; or floats are refused, as the library beneath computes
# in integers.
#
# What happens: each coordinate loses what stands behind its point, without a word. The union of
# 15.75 m2 comes back as a rectangle of 12 m2, from (0, 0) to (6, 2). Who draws in millimetres never
# sees it; who has metres must call `scale_to_clipper` and `scale_from_clipper`.
#
# Seen:
#   wanted (0.4, 0.4) to (6.7, 2.9): 15.75 m2
#   union  (0, 0) to (6, 2): 12.00 m2
#   scaled (0.4, 0.4) to (6.7, 2.9): 15.75 m2
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q --disable-pip-version-check --no-cache-dir \
    pyclipper==1.4.0
"$work/venv/bin/python" - <<'EOF'
import sys

import pyclipper

ROOM = [(0.4, 0.4), (3.7, 0.4), (3.7, 2.9), (0.4, 2.9)]
OTHER = [(2.0, 0.4), (6.7, 0.4), (6.7, 2.9), (2.0, 2.9)]


def union(*outlines):
    clipper = pyclipper.Pyclipper()
    clipper.AddPaths(outlines, pyclipper.PT_SUBJECT, True)
    [whole] = clipper.Execute(
        pyclipper.CT_UNION, pyclipper.PFT_NONZERO, pyclipper.PFT_NONZERO
    )
    return whole


def area(ring):
    following = ring[1:] + ring[:1]
    return abs(sum(x * v - u * y for (x, y), (u, v) in zip(ring, following, strict=True))) / 2


def tell(name, ring):
    low, high = min(ring), max(ring)
    corners = [f"({round(x, 6):g}, {round(y, 6):g})" for x, y in (low, high)]
    print(f"{name:6} {corners[0]} to {corners[1]}: {area(ring):.2f} m2")


whole = union(ROOM, OTHER)
scaled = pyclipper.scale_from_clipper(union(*map(pyclipper.scale_to_clipper, (ROOM, OTHER))))
print("wanted (0.4, 0.4) to (6.7, 2.9): 15.75 m2")
tell("union", whole)
tell("scaled", [tuple(corner) for corner in scaled])
sys.exit(0 if area(whole) == 12 and abs(area(scaled) - 15.75) < 1e-6 else 1)
EOF
