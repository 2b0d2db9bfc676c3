#!/usr/bin/env bash
# gtsam 4.3.0: writeG2o writes six significant digits: coordinates of a survey lose metres.
#
# Expected: a pose graph that is written and read again is the same up to a rounding far below
# anything measured. g2o's format is text without a limit of digits, `writeG2o` takes doubles and
# documents no precision, and the files are what is exchanged between solvers.
#
# What happens: numbers go out as C++ streams write them by default, with six significant digits.
# Around a local origin that is well hidden (0.1 mm at 100 m). In UTM, where outdoor robots with a
# GNSS receiver work, a northing of 5 412 345.68 m becomes 5.41235e+06: off by 4.3 m, and poses
# 1.4 m apart are written as the same northing. The same happens to the measurement and to the
# information of an edge, and to headings after 1e-6 rad.
#
# Seen:
#   VERTEX_SE2 0 455123 5.41235e+06 0.123457
#   VERTEX_SE2 1 455124 5.41235e+06 0.123457
#   read back: off by 4.35 m; step of 1.41 m has become 1.00 m
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q --disable-pip-version-check --no-cache-dir \
    gtsam==4.3.0 numpy==2.4.6
"$work/venv/bin/python" - "$work/graph.g2o" <<'EOF'
import math
import sys
from pathlib import Path

import gtsam

poses = [
    gtsam.Pose2(455123.4567, 5412345.6789, 0.123456789),
    gtsam.Pose2(455124.4567, 5412346.6789, 0.123456789),
]
values = gtsam.Values()
for key, pose in enumerate(poses):
    values.insert(key, pose)
graph = gtsam.NonlinearFactorGraph()
graph.add(
    gtsam.BetweenFactorPose2(
        0, 1, poses[0].between(poses[1]), gtsam.noiseModel.Isotropic.Sigma(3, 0.1)
    )
)
gtsam.writeG2o(graph, values, sys.argv[1])
lines = Path(sys.argv[1]).read_text().splitlines()
print("\n".join(line for line in lines if line.startswith("VERTEX")))
_, again = gtsam.readG2o(sys.argv[1], False)


def apart(a, b):
    return math.hypot(a.x() - b.x(), a.y() - b.y())


off = apart(again.atPose2(0), poses[0])
before, after = apart(*poses), apart(again.atPose2(0), again.atPose2(1))
print(f"read back: off by {off:.2f} m; step of {before:.2f} m has become {after:.2f} m")
sys.exit(0 if off > 1 and abs(after - before) > 0.2 else 1)
EOF
