#!/usr/bin/env bash
# rdp 0.8: simplifying a drive into a dead end and back leaves the dead end out, at any tolerance.
#
# Expected: by the rule of Ramer, Douglas and Peucker, each vertex that is left out is within epsilon
# of the segment that replaces it.
#
# What happens: distances are measured to the straight line through the ends, not to the segment
# between them. A vertex that lies beyond an end, on that line, has distance 0: a corridor driven
# 10 m in and 9 m out becomes 1 m. Both the recursive and the iterative form do so. GEOS (shapely's
# simplify) measures to the segment and keeps the far end. Outlines that never double back look the
# same with either.
#
# Seen:
#   driven          19.0 m, 10.0 m into the corridor
#   rdp, rec         1.0 m, 1.0 m into the corridor
#   rdp, iter        1.0 m, 1.0 m into the corridor
#   shapely         19.0 m, 10.0 m into the corridor
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q --disable-pip-version-check --no-cache-dir \
    rdp==0.8 shapely==2.1.2 numpy==2.4.6
"$work/venv/bin/python" - <<'EOF'
import sys

import numpy as np
import shapely
from rdp import rdp

TOLERANCE = 0.05  # [m]
drive = np.array([(x, 0.0) for x in (0, 2, 4, 6, 8, 10, 8, 6, 4, 2, 1)])


def told(name, way):
    way = np.asarray(way)
    length = np.linalg.norm(np.diff(way, axis=0), axis=1).sum()
    print(f"{name:15} {length:4.1f} m, {way[:, 0].max():.1f} m into the corridor")
    return round(float(way[:, 0].max()), 6)


told("driven", drive)
kept = [told(f"rdp, {how}", rdp(drive, epsilon=TOLERANCE, algo=how)) for how in ("rec", "iter")]
whole = told("shapely", shapely.get_coordinates(shapely.LineString(drive).simplify(TOLERANCE)))
sys.exit(0 if kept == [1, 1] and whole == 10 else 1)
EOF
