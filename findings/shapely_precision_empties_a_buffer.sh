#!/usr/bin/env bash
# shapely 2.2.0 (GEOS 3.14.1): a room on a grid of 5 cm, grown by 2 cm, is empty.
#
# Expected: `set_precision` rounds corners to a grid, to store a map small or to clean it. Its
# documentation says what follows: later operations are done "in the precision of the geometry with
# higher precision (smaller grid_size)". So a room on a grid and a door as measured give exact
# results, and A union B is B union A.
#
# What happens: the grid is a hidden part of the geometry, and it is that of the first operand that
# counts: room.union(door) loses a door 2 cm deep, door.union(room) keeps it. `union_all` takes the
# coarse one in any order. In `buffer`, where there is but one, corners of the result are rounded
# to the grid: grown or shrunk by less than half of it, the room is not as before, it is empty.
# Nothing is raised, `wkt` is the same with the grid and without, and a copy by WKB has lost it:
# the same program works on a map that was read from a file. `set_precision(room, 0)` takes it away.
#
# Seen (a room of 100 m2 on a grid of 5 cm; a door of 10 m by 2 cm beside it):
#   room.union(door)     100.0 m2
#   door.union(room)     100.2 m2
#   union_all            100.0 m2
#   room.buffer(0.02)      0.0 m2
#   room.buffer(-0.02)     0.0 m2
#   by WKB, buffer(0.02) 100.8 m2
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q --disable-pip-version-check --no-cache-dir \
    shapely==2.2.0 numpy==2.4.6
"$work/venv/bin/python" - <<'EOF'
import sys

import shapely

room = shapely.set_precision(shapely.box(0, 0, 10, 10), 0.05)
door = shapely.box(10, 0, 10.02, 10)
copy = shapely.from_wkb(shapely.to_wkb(room))
assert copy.wkt == room.wkt and room.area == 100

AREAS = {
    "room.union(door)": room.union(door),
    "door.union(room)": door.union(room),
    "union_all": shapely.union_all([door, room]),
    "room.buffer(0.02)": room.buffer(0.02),
    "room.buffer(-0.02)": room.buffer(-0.02),
    "by WKB, buffer(0.02)": copy.buffer(0.02),
}
for name, result in AREAS.items():
    print(f"{name:20} {result.area:5.1f} m2")
seen = [round(result.area, 1) for result in AREAS.values()]
sys.exit(0 if seen == [100.0, 100.2, 100.0, 0.0, 0.0, 100.8] else 1)
EOF
