#!/usr/bin/env bash
# pyvisgraph 0.2.1: east of x = 10,000 the shortest path leads through the walls.
#
# Expected: the shortest path around obstacles is the same wherever the origin is; coordinates are
# doubles, in which a micrometre is left in UTM.
#
# What happens: whether a wall is in the way is asked along a ray to the right, and the ray ends
# at x = 10,000, a constant that stands for infinity. What is further east lies behind the ray's
# end: walls that begin below the robot's eye and end above it are not found, and a straight line
# through two walls is the answer. Nothing is raised. Eastings of UTM begin at 160,000; a map
# in millimetres ends after ten metres. With negative x of any size the path is right.
#
# Seen (two walls, from (0, 2) to (6, 3)):
#   at the origin    7.96 m, 0.00 m of it in walls
#   9 km east        7.96 m, 0.00 m of it in walls
#   20 km west       7.96 m, 0.00 m of it in walls
#   11 km east       6.08 m, 0.40 m of it in walls
#   in UTM           6.08 m, 0.40 m of it in walls
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q --disable-pip-version-check --no-cache-dir \
    pyvisgraph==0.2.1 tqdm==4.67.1 shapely==2.2.0 numpy==2.4.6
"$work/venv/bin/python" - <<'EOF'
import sys

import pyvisgraph
import shapely
from shapely.affinity import translate

WALLS = [shapely.box(2, 0, 2.2, 4), shapely.box(4, 1, 4.2, 6)]
PLACES = {
    "at the origin": (0, 0),
    "9 km east": (9_000, 0),
    "20 km west": (-20_000, 0),
    "11 km east": (11_000, 0),
    "in UTM": (691_000, 5_335_000),
}


def path(name, east, north):
    walls = [translate(wall, east, north) for wall in WALLS]
    graph = pyvisgraph.VisGraph()
    corners = [[pyvisgraph.Point(*at) for at in wall.exterior.coords[:-1]] for wall in walls]
    graph.build(corners, status=False)
    start, goal = pyvisgraph.Point(east, north + 2), pyvisgraph.Point(east + 6, north + 3)
    line = shapely.LineString([(at.x, at.y) for at in graph.shortest_path(start, goal)])
    inside = sum(line.intersection(wall.buffer(-1e-3)).length for wall in walls)
    print(f"{name:15}  {line.length:.2f} m, {inside:.2f} m of it in walls")
    return inside > 0.1


seen = [path(name, *place) for name, place in PLACES.items()]
sys.exit(0 if seen == [False, False, False, True, True] else 1)
EOF
