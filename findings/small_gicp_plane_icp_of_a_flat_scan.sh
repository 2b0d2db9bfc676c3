#!/usr/bin/env bash
# small_gicp 1.0.1: PLANE_ICP of two planar scans reports convergence, error 0 and every point an
# inlier, and has not moved anything.
#
# Expected: point-to-plane ICP is the usual choice for walls, and the package takes points as N x 3,
# so a 2D scan goes in with z = 0. `align` estimates the normals itself. For two scans of a room
# that are 0.36 m and 2.9 degrees apart the answer is that motion, as with registration_type "ICP"
# and "GICP" on the same arrays, or a failure, as the height is not observable.
#
# What happens: the normals are estimated in 3D. All points lie in the plane z = 0, so each normal
# is (0, 0, 1), every residual along it is zero at the start, and the first iteration is the last:
# identity, error 0.0, converged, all points inliers. By the fields one gates on it is the best
# registration there is.
#
# Seen:
#   motion wanted: 0.300 m, 0.200 m, 0.050 rad
#   PLANE_ICP: 0.000 m, 0.000 m, 0.000 rad; converged True, error 0, inliers 346 of 346
#   ICP:       0.295 m, 0.204 m, 0.049 rad; converged True, error 0.0579, inliers 346 of 346
#   GICP:      0.295 m, 0.204 m, 0.049 rad; converged True, error 0.0289, inliers 346 of 346
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q --disable-pip-version-check --no-cache-dir \
    small_gicp==1.0.1 numpy==2.4.6
"$work/venv/bin/python" - <<'EOF'
import math
import sys

import numpy as np
import small_gicp

X, Y, TURN = 0.3, 0.2, 0.05  # m, m, rad: the motion wanted
along = np.linspace(0, 1, 200)
zero = 0 * along
walls = np.concatenate(
    [
        np.column_stack([10 * along, zero]),
        np.column_stack([10 * along, zero + 6]),
        np.column_stack([zero, 6 * along]),
        np.column_stack([zero + 10, 6 * along]),
    ]
)
target = walls + np.random.default_rng(0).normal(0, 0.005, walls.shape)
c, s = math.cos(TURN), math.sin(TURN)
source = (target - [X, Y]) @ np.array([[c, -s], [s, c]])


def flat(points):
    return np.column_stack([points, np.zeros(len(points))])


def points_used():
    return small_gicp.voxelgrid_sampling(flat(source), 0.1).size()


results = {}
print(f"motion wanted: {X:.3f} m, {Y:.3f} m, {TURN:.3f} rad")
for kind in ("PLANE_ICP", "ICP", "GICP"):
    r = small_gicp.align(
        flat(target), flat(source), registration_type=kind, downsampling_resolution=0.1
    )
    x, y = r.T_target_source[:2, 3]
    turn = math.atan2(r.T_target_source[1, 0], r.T_target_source[0, 0])
    results[kind] = (x, y, turn, r)
    print(
        f"{kind + ':':10} {x:.3f} m, {y:.3f} m, {turn:.3f} rad; converged {r.converged}, "
        f"error {r.error:.3g}, inliers {r.num_inliers} of {points_used()}"
    )


def near(kind, wanted):
    return np.allclose(results[kind][:3], wanted, atol=0.02) and results[kind][3].converged


plane = results["PLANE_ICP"][3]
still = near("PLANE_ICP", 0) and plane.error == 0 and plane.num_inliers == points_used()
moved = near("ICP", (X, Y, TURN)) and near("GICP", (X, Y, TURN))
sys.exit(0 if still and moved else 1)
EOF
