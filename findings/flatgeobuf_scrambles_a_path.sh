#!/usr/bin/env bash
# FlatGeobuf by geopandas 1.2.0 (pyogrio 0.13.0): a path written as points comes back in another order.
#
# Expected: rows of a table are written in their order, and read in it, as from GeoPackage and GeoJSON,
# from one call to the next with nothing but the name of the file changed. Poses of a robot, a point
# for each scan, are a path because of their order.
#
# What happens: the format sorts its features along a space-filling curve, as it has an index of
# places by default, and keeps no number of where a row was. Read back, the drive begins elsewhere and
# jumps across the hall and back, and is twice as long. Nothing is said on writing, and a table of
# stamps or scans beside it, row by row, belongs to other poses. With SPATIAL_INDEX="NO" the order
# stays.
#
# Seen (200 poses of a drive once around a hall):
#   gpkg              63 m,   0 of 200 poses in another row
#   geojson           63 m,   0 of 200 poses in another row
#   fgb              130 m, 200 of 200 poses in another row
#   fgb, no index     63 m,   0 of 200 poses in another row
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q --disable-pip-version-check --no-cache-dir \
    geopandas==1.2.0 pyogrio==0.13.0 shapely==2.2.0 numpy==2.4.6 pandas==3.1.1
"$work/venv/bin/python" - "$work" <<'EOF'
import sys
import warnings
from pathlib import Path

import geopandas
import numpy as np
import shapely

warnings.simplefilter("ignore")  # that a robot's map is in no system of the earth
FOLDER = Path(sys.argv[1])
around = np.linspace(0, 2 * np.pi, 200)
poses = 10 * np.column_stack([np.cos(around), np.sin(around)])
rows = np.arange(len(poses))
table = geopandas.GeoDataFrame({"row": rows}, geometry=geopandas.points_from_xy(*poses.T))


def read(name, file, **options):
    table.to_file(FOLDER / file, **options)
    back = geopandas.read_file(FOLDER / file)
    length = shapely.LineString(back.geometry.get_coordinates().to_numpy()).length
    moved = int((back["row"] != rows).sum())
    print(f"{name:14}  {length:4.0f} m, {moved:3} of {len(back)} poses in another row")
    return moved, round(length)


seen = [
    read("gpkg", "path.gpkg"),
    read("geojson", "path.geojson"),
    read("fgb", "path.fgb"),
    read("fgb, no index", "plain.fgb", SPATIAL_INDEX="NO"),
]
length = seen[0][1]
same = [one == (0, length) for one in seen]
sys.exit(0 if same == [True, True, False, True] and seen[2][1] > 1.5 * length else 1)
EOF
