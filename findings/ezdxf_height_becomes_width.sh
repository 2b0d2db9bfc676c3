#!/usr/bin/env bash
# ezdxf 1.4.5: the height of a wall becomes the width of its line.
#
# Expected: `add_lwpolyline` given corners (x, y, z) draws them at height z, as `add_polyline3d` and
# `add_line` do with the same values; or refuses three values a corner, as an LWPOLYLINE is flat.
#
# What happens: the third value is the width with which the segment starts (the format "xyseb" is
# the default), the height is 0. A wall at 2.5 m comes out as a line on the floor that tapers from
# 2.5 m to nothing: valid DXF, shown by every viewer as a solid wedge.
#
# Seen:
#   LWPOLYLINE: heights [0.0, 0.0, 0.0], widths at start [2.5, 2.5, 2.5], at end [0.0, 0.0, 0.0]
#   POLYLINE 3D: heights [2.5, 2.5, 2.5]
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q --disable-pip-version-check --no-cache-dir \
    ezdxf==1.4.5
"$work/venv/bin/python" - <<'EOF'
import io
import sys

import ezdxf

CORNERS = [(0.0, 0.0, 2.5), (4.0, 0.0, 2.5), (4.0, 3.0, 2.5)]
drawing = ezdxf.new()
space = drawing.modelspace()
space.add_lwpolyline(CORNERS)
space.add_polyline3d(CORNERS)
written = io.StringIO()
drawing.write(written)
written.seek(0)
back = ezdxf.read(written).modelspace()  # what the file says, not what is in memory
[flat] = back.query("LWPOLYLINE")
[solid] = back.query("POLYLINE")
heights = [float(corner.z) for corner in flat.vertices_in_wcs()]
starts, ends = ([float(corner[k]) for corner in flat] for k in (2, 3))
print(f"LWPOLYLINE: heights {heights}, widths at start {starts}, at end {ends}")
upright = [float(corner.dxf.location.z) for corner in solid.vertices]
print(f"POLYLINE 3D: heights {upright}")
sys.exit(0 if heights == [0.0] * 3 and starts == [2.5] * 3 and upright == [2.5] * 3 else 1)
EOF
