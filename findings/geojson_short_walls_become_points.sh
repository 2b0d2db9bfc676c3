#!/usr/bin/env bash
# geojson 3.3.0: a map in degrees is rounded to a tenth of a metre: short walls become points.
#
# Expected: `geojson.LineString` keeps the corners it is given, as `json.dumps` of the same dictionary
# and shapely's `to_geojson` do: a float is written so that it reads back the same.
#
# What happens: each geometry rounds its coordinates to six places as it is made. In metres that is
# nothing; in degrees of latitude it is 11 cm, of longitude 7 cm at 50 degrees north. Jambs of a door,
# 4 cm deep, become a line of length zero, which most programs do not draw; walls of a building come
# out up to 6 cm off. No word is said. `geojson.loads` rounds as well: what another program wrote with
# all its digits is shortened by being read. `precision=` of each geometry gives the digits back;
# `loads` takes none.
#
# Seen:
#   json        0.040 m
#   shapely     0.040 m
#   geojson     0.000 m
#   read back   0.000 m
#   precision   0.040 m
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q --disable-pip-version-check --no-cache-dir \
    geojson==3.3.0 shapely==2.2.0 numpy==2.4.6
"$work/venv/bin/python" - <<'EOF'
import json
import math
import sys

import geojson
import shapely

METRE = 180 / math.pi / 6_378_137.0  # [deg] of latitude
jamb = [(8.65123412, 49.87654312), (8.65123412, 49.87654312 + 0.04 * METRE)]


def length(name, text):
    (_, south), (_, north) = json.loads(text)["coordinates"]
    metres = (north - south) / METRE
    print(f"{name:10}  {metres:.3f} m")
    return round(metres, 3)


exact = json.dumps({"type": "LineString", "coordinates": jamb})
seen = [
    length("json", exact),
    length("shapely", shapely.to_geojson(shapely.LineString(jamb))),
    length("geojson", geojson.dumps(geojson.LineString(jamb))),
    length("read back", geojson.dumps(geojson.loads(exact))),
    length("precision", geojson.dumps(geojson.LineString(jamb, precision=10))),
]
sys.exit(0 if seen == [0.04, 0.04, 0, 0, 0.04] else 1)
EOF
