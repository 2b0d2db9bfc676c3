#!/usr/bin/env bash
# shapely 2.1.2 (GEOS 3.13.1): clip_by_rect returns the part of the rectangle that is NOT covered.
#
# Expected: the part of a polygon within a rectangle. The documentation warns that the fast way may
# be "dirty": that the output may be invalid. So one clips, asks `is_valid`, repairs what is not,
# and believes the rest; free space cut into tiles is the usual use.
#
# What happens: the outline below touches a corner of the rectangle with one of its vertices and
# dips into it with another. What comes back is a valid polygon, and the wrong one: the notch
# between the outline and the rectangle's edge, 1.5 m2, in place of the 14.5 m2 that the polygon
# covers. It shares no area with the polygon at all. No check of validity can find that; only the
# area against `intersection` does. With another outline the answer holds both the notch and the
# whole rectangle's rest, overlapping.
#
# Seen:
#   polygon within the rectangle: 14.5 m2 by intersection, 1.5 m2 by clip_by_rect
#   valid: True; area shared with the polygon: 0.0 m2
#   whole plus notch: 12.75 m2 of a polygon that has 11.25 m2 there
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q --disable-pip-version-check --no-cache-dir \
    shapely==2.1.2 numpy==2.4.6
"$work/venv/bin/python" - <<'EOF'
import sys

import shapely

TILE = (-2.0, -2.0, 2.0, 2.0)


def clipped(corners):
    polygon = shapely.Polygon(corners)
    assert polygon.is_valid
    return polygon, shapely.clip_by_rect(polygon, *TILE), polygon.intersection(shapely.box(*TILE))


room, fast, true = clipped([(2, 2), (0, 1), (-2, 3), (-4, -3), (2, -4)])
print(f"polygon within the rectangle: {true.area} m2 by intersection, {fast.area} m2 by clip_by_rect")
shared = fast.intersection(room).area
print(f"valid: {fast.is_valid}; area shared with the polygon: {shared} m2")
_, both, part = clipped([(5, 1), (-5, 1), (-5, -1), (-5, -3), (2, -2), (1, -1)])
print(f"whole plus notch: {both.area} m2 of a polygon that has {part.area} m2 there")
same = fast.is_valid and shared < 1e-9 and (true.area, fast.area) == (14.5, 1.5)
sys.exit(0 if same and both.area > part.area + 1 else 1)
EOF
