#!/usr/bin/env bash
# gtsam 4.3.0: load2D reads the information matrix of a g2o file as a covariance: weights inverted.
#
# Expected: `load2D` says it reads TORO and g2o files ("EDGE_SE2" and "EDGE2" both), and its
# `noiseFormat` is by default "auto", described as trying to guess the layout. The tag EDGE_SE2 is
# g2o's own, and g2o's format fixes what follows: the upper triangle of the information matrix, row
# by row, I11 I12 I13 I22 I23 I33. So 400 0 0 400 0 10000 is 5 cm, 5 cm and 0.01 rad.
#
# What happens: the guess looks only at which of the six numbers are zero, not at the tag. Zeros at
# places 2, 3 and 5, which is what every uncorrelated g2o edge has, are taken for a covariance
# matrix in that order. Sigmas come out as 20 m, 20 m and 100 rad: 400 and 10000 times too loose,
# without a word. Where all edges are of one kind the optimum barely moves, so it is found only when
# gates, chi-squares or a prior come in; with mixed edges the best ones weigh least.
# `readG2o` on the same file is right. A correlated edge makes load2D raise.
#
# Seen:
#   load2D:                [20.0, 20.0, 100.0]
#   load2D, format named:  [0.05, 0.05, 0.01]
#   readG2o:               [0.05, 0.05, 0.01]
#   two odometries of 10 m (sigma 1 cm) and 11 m (sigma 1 m): 11.0 m by load2D, 10.0 m by readG2o
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q --disable-pip-version-check --no-cache-dir \
    gtsam==4.3.0 numpy==2.4.6
"$work/venv/bin/python" - "$work/graph.g2o" <<'EOF'
import sys
from pathlib import Path

import gtsam
import numpy as np

PATH = sys.argv[1]
NODES = "VERTEX_SE2 0 0 0 0\nVERTEX_SE2 1 10 0 0\n"


def auto():
    return gtsam.load2D(PATH)


def named():
    return gtsam.load2D(PATH, noiseFormat=gtsam.NoiseFormat.NoiseFormatG2O)


def g2o():
    return gtsam.readG2o(PATH, False)


Path(PATH).write_text(NODES + "EDGE_SE2 0 1 10 0 0 400 0 0 400 0 10000\n")
sigmas = {}
for name, read in {"load2D": auto, "load2D, format named": named, "readG2o": g2o}.items():
    sigmas[name] = read()[0].at(0).noiseModel().sigmas().round(6).tolist()
    print(f"{name + ':':22} {sigmas[name]}")

Path(PATH).write_text(
    NODES
    + "EDGE_SE2 0 1 10 0 0 10000 0 0 10000 0 10000\n"
    + "EDGE_SE2 0 1 11 0 0 1 0 0 1 0 1\n"
)


def solved(read):
    graph, values = read()
    tight = gtsam.noiseModel.Isotropic.Sigma(3, 1e-6)
    graph.add(gtsam.PriorFactorPose2(0, gtsam.Pose2(), tight))
    best = gtsam.LevenbergMarquardtOptimizer(graph, values).optimize()
    return round(best.atPose2(1).x(), 2)


print(
    f"two odometries of 10 m (sigma 1 cm) and 11 m (sigma 1 m): "
    f"{solved(auto)} m by load2D, {solved(g2o)} m by readG2o"
)
right = np.array([0.05, 0.05, 0.01])
same = np.allclose(sigmas["load2D"], 1 / right) and np.allclose(sigmas["readG2o"], right)
sys.exit(0 if same and solved(auto) > 10.9 and solved(g2o) < 10.1 else 1)
EOF
