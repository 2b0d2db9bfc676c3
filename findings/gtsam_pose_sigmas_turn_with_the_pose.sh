#!/usr/bin/env bash
# gtsam 4.3.0: a pose's sigmas in x and y are ahead and aside of it, a position's are along the axes.
#
# Expected: `PriorFactorPose2` takes a pose in the world and three sigmas, for x, y and heading; and
# `PoseTranslationPrior2D` such a pose and two, for x and y. A corridor that runs north tells a robot
# its x to a centimetre and its y to ten metres, so 0.01 and 10 go into either. `Marginals` then
# gives a 3x3 covariance of a pose, whose first two rows are of x and y as well.
#
# What happens: the error of a pose is taken in its tangent space, along the pose's own axes. Of a robot
# that faces east the sigmas are those of x and y. One that faces north has the first of them ahead,
# which is y: it is held in place along the corridor and may drift through its walls. The prior of
# the position alone has its sigmas along the world's axes, whatever the heading. Marginal covariances are
# along the pose's axes in each case, so an ellipse drawn from them as they are lies across the corridor.
# Nothing is raised, the optimum is found, and tests that face along x are right.
#
# Seen (the corridor says x = 0, other sensors (5, 5) to a metre; the right answer is 0.00, 4.95):
#   facing east,  prior of the pose:      at  0.00  4.95, marginal sigmas 0.01 1.00
#   facing north, prior of the pose:      at  4.95  0.00, marginal sigmas 0.01 1.00
#   facing east,  prior of the position:  at  0.00  4.95, marginal sigmas 0.01 1.00
#   facing north, prior of the position:  at  0.00  4.95, marginal sigmas 1.00 0.01
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q --disable-pip-version-check --no-cache-dir \
    gtsam==4.3.0 numpy==2.4.6
"$work/venv/bin/python" - <<'EOF'
import math
import sys

import gtsam
import numpy as np

ACROSS, ALONG, TURN = 0.01, 10.0, 0.001  # [m], [m], [rad]
FACING = {"east": 0.0, "north": math.pi / 2}


def sigmas(*values):
    return gtsam.noiseModel.Diagonal.Sigmas(np.array(values))


def of_pose(heading):
    """Return what the corridor says, as a prior of the pose."""
    there = gtsam.Pose2(0, 0, heading)
    return gtsam.PriorFactorPose2(0, there, sigmas(ACROSS, ALONG, TURN))


def of_position(heading):
    """Return what the corridor says, as a prior of the position."""
    return gtsam.PoseTranslationPrior2D(0, gtsam.Pose2(0, 0, heading), sigmas(ACROSS, ALONG))


def solved(prior, heading):
    """Return the position that is found, and the marginal sigmas of the first two rows."""
    graph, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
    graph.add(prior(heading))
    graph.add(gtsam.PriorFactorPose2(0, gtsam.Pose2(5, 5, heading), sigmas(1, 1, TURN)))
    values.insert(0, gtsam.Pose2(5, 5, heading))
    best = gtsam.LevenbergMarquardtOptimizer(graph, values).optimize()
    spread = np.sqrt(np.diag(gtsam.Marginals(graph, best).marginalCovariance(0)))
    return [best.atPose2(0).x(), best.atPose2(0).y(), *spread[:2]]


seen = []
for name, prior in {"pose": of_pose, "position": of_position}.items():
    for way, heading in FACING.items():
        x, y, first, second = solved(prior, heading)
        seen.append([x, y, first, second])
        told = f"facing {way + ',':6} prior of the {name + ':':10} at {abs(x):5.2f} {abs(y):5.2f}"
        print(f"{told}, marginal sigmas {first:.2f} {second:.2f}")
right, turned = [0, 4.95], [4.95, 0]
expected = [[*right, 0.01, 1], [*turned, 0.01, 1], [*right, 0.01, 1], [*right, 1, 0.01]]
sys.exit(0 if np.allclose(seen, expected, atol=0.02) else 1)
EOF
