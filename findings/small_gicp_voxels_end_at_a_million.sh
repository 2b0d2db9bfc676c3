#!/usr/bin/env bash
# small_gicp 1.0.1: downsampling in a projected coordinate system leaves one point of a building.
#
# Expected: a scan placed in UTM coordinates (metres, some hundred thousand east, some million
# north) is downsampled as the same scan near the origin is; points are doubles, in which a
# micrometre is left there.
#
# What happens: a voxel's three indices are packed into 21 bits each, so they reach to 2^20 voxels:
# 26 km at 0.025 m, 262 km at 0.25 m. What lies beyond is left out of the voxels (the standard error
# stream gets a line for each point, without which point or why), nothing is raised, and one point
# comes back. `preprocess_points`, and `align` of arrays, downsample in the same way.
#
# Seen:
#   0.25 m, near the origin: 1000 points -> 920
#   0.25 m, in UTM:          1000 points -> 1
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q --disable-pip-version-check --no-cache-dir \
    small_gicp==1.0.1 numpy==2.4.6
"$work/venv/bin/python" - <<'EOF'
import sys

import numpy as np
import small_gicp

EAST, NORTH = 691_000.0, 5_335_000.0  # a town
rng = np.random.default_rng(1)
hall = np.column_stack([rng.uniform(0, 20, (1000, 2)), np.zeros(1000)])
utm = np.array([EAST, NORTH, 0.0])


def left(points):
    return small_gicp.voxelgrid_sampling(points, 0.25).size()


near, far = left(hall), left(hall + utm)
print(f"0.25 m, near the origin: {len(hall)} points -> {near}")
print(f"0.25 m, in UTM:          {len(hall)} points -> {far}")
sys.exit(0 if near > 900 and far == 1 else 1)
EOF
