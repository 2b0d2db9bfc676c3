#!/usr/bin/env bash
# trimesh 5.2.0: a line far away moves the corners of a plan: walls 4 cm apart become one.
#
# Expected: `load_path` of a DXF joins ends that are one point; its tolerance for that, `tol.merge`
# of paths, is 1e-5. A corner keeps its place whatever else is drawn. Plans in projected coordinates
# often have something at the origin as well: a frame, a north arrow, a legend.
#
# What happens: the tolerance is 1e-5 of the extent of the whole drawing, given as a number of
# decimals, one at least: 1 cm for a site of 1 km, 10 cm from 10 km on. A line at the origin makes
# the extent 5,000 km. All ends that round to the same decimetre become one corner: the faces of a
# thin wall fall onto each other, and the jamb of a door is left out, its ends being one. Nothing
# is raised. The file is right: ezdxf gives the corners as they were drawn.
#
# Seen (a thin wall of two faces and a jamb, in UTM):
#   alone                  3 lines of the plan; faces 0.040 m apart
#   with a line at (0, 0)  2 lines of the plan; faces 0.000 m apart
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q --disable-pip-version-check --no-cache-dir \
    trimesh==5.2.0 ezdxf==1.4.5 numpy==2.4.6 scipy==1.17.1 networkx==3.6.1 shapely==2.2.0
"$work/venv/bin/python" - "$work/plan.dxf" <<'EOF'
import sys

import ezdxf
import numpy as np
import trimesh

PATH = sys.argv[1]
UTM = np.array([691_000.0, 5_335_000.0])  # a town
PLAN = {
    "FACE": [(0, 0), (10, 0)],
    "OTHER_FACE": [(0, 0.04), (10, 0.04)],
    "JAMB": [(4, 1), (4.03, 1)],
}


def loaded(name, far):
    drawing = ezdxf.new()
    for layer, ends in PLAN.items():
        drawing.modelspace().add_line(*(np.array(ends) + UTM), dxfattribs={"layer": layer})
    if far:
        drawing.modelspace().add_line((0, 0), (0.2, 0), dxfattribs={"layer": "FRAME"})
    drawing.saveas(PATH)
    path = trimesh.load_path(PATH)
    lines = {line.layer: path.vertices[line.points] for line in path.entities}
    apart = abs(lines["OTHER_FACE"][:, 1].mean() - lines["FACE"][:, 1].mean())
    count = len(lines.keys() & PLAN.keys())
    print(f"{name:21}  {count} lines of the plan; faces {apart:.3f} m apart")
    return count, round(float(apart), 3)


seen = [loaded("alone", False), loaded("with a line at (0, 0)", True)]
sys.exit(0 if seen == [(3, 0.04), (2, 0)] else 1)
EOF
