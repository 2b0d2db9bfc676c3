#!/usr/bin/env bash
# evo 1.38.1: aligned in the usual way, a 2D trajectory that is mirrored has an error of zero.
#
# Expected: a sign slipped in the angle convention of a laser, and every left turn is mapped as a
# right turn. The trajectory is the mirror image of the truth. `align` (and `evo_ape --align`) is
# Umeyama's method, whose whole point over plain least squares is that it returns a rotation and
# never a reflection; the remaining error of a mirrored plan should be metres.
#
# What happens: TUM files and evo are three-dimensional. A trajectory in the plane z = 0 turned by
# 180 degrees about an axis in that plane lands in the plane again, mirrored: a proper rotation, so
# it is allowed, and it fits exactly. The translational APE, the number in every table, is 0. The
# rotation found has -1 in its lower right corner, which nothing looks at. Where the same points
# are aligned in two dimensions the error is 10.6 m.
#
# Seen:
#   APE of the mirrored trajectory, aligned by evo: 0.000 m
#   rotation used: diag [-1.0, 1.0, -1.0]
#   the same points aligned within the plane: 10.632 m
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q --disable-pip-version-check --no-cache-dir \
    evo==1.38.1 numpy==2.4.6
"$work/venv/bin/python" - <<'EOF'
import sys

import numpy as np
from evo.core import geometry, metrics
from evo.core.trajectory import PosePath3D

truth = np.random.default_rng(0).uniform(0, 20, (40, 2)).round(2)
mirrored = truth * [-1, 1]


def path(points):
    level = np.tile([1.0, 0.0, 0.0, 0.0], (len(points), 1))
    return PosePath3D(np.column_stack([points, np.zeros(len(points))]), level)


reference, estimate = path(truth), path(mirrored)
rotation, _, _ = estimate.align(reference)
ape = metrics.APE(metrics.PoseRelation.translation_part)
ape.process_data((reference, estimate))
rmse = float(ape.get_statistic(metrics.StatisticsType.rmse))
print(f"APE of the mirrored trajectory, aligned by evo: {rmse:.3f} m")
print(f"rotation used: diag {(np.diag(rotation).round(3) + 0.0).tolist()}")
r, t, _ = geometry.umeyama_alignment(mirrored.T, truth.T, False)
left = np.linalg.norm((r @ mirrored.T).T + t - truth, axis=1)
planar = float(np.sqrt((left**2).mean()))
print(f"the same points aligned within the plane: {planar:.3f} m")
sys.exit(0 if rmse < 1e-6 and rotation[2, 2] < -0.999 and planar > 1 else 1)
EOF
