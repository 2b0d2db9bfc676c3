#!/usr/bin/env bash
# scikit-learn 1.9.1: NearestNeighbors with default settings is exact for 50 points and off by
# centimetres for 10, at the same place.
#
# Expected: the algorithm is "auto" and chosen for speed; trees and brute force are documented as
# ways to the same neighbours. Distances of 1 cm at UTM coordinates (5400 km) are far above the
# rounding of doubles, so a set of few points should be the easier one.
#
# What happens: with k of at least half the points, brute force is chosen. That expands the
# square, |a|^2 - 2ab + |b|^2, and subtracts numbers near 3e13, whose last bit is a 1/256: what is
# 5 cm or nearer comes back as 0 or wrong by as much. `euclidean_distances` warns of that in its own
# page; the neighbour search, and what is built on it, does not. A matcher of landmarks with a gate
# of a few centimetres accepts or refuses by the number of landmarks in view. Small coordinates, or
# algorithm="kd_tree", are right.
#
# Seen (each query is 0.0100 m from its point):
#   50 points, 5 neighbours: kd_tree, nearest at 0.0100 to 0.0100 m
#   10 points, 5 neighbours: brute, nearest at 0.0000 to 0.0625 m
#   10 points, local origin: brute, nearest at 0.0100 to 0.0100 m
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q --disable-pip-version-check --no-cache-dir \
    scikit-learn==1.9.1 scipy==1.17.1 numpy==2.4.6
"$work/venv/bin/python" - <<'EOF'
import sys

import numpy as np
from sklearn.neighbors import NearestNeighbors

UTM = np.array([455_123.0, 5_412_345.0])
landmarks = np.random.default_rng(0).uniform(0, 30, (50, 2)).round(2)


def nearest(name, points):
    search = NearestNeighbors(n_neighbors=5).fit(points)
    distance = search.kneighbors(points + [0.01, 0])[0][:, 0]
    # the attribute is private; it is read only to show which way was taken
    print(
        f"{len(points)} points, {name}: {search._fit_method}, "
        f"nearest at {distance.min():.4f} to {distance.max():.4f} m"
    )
    return float(abs(distance - 0.01).max())


print("each query is 0.0100 m from its point:")
many = nearest("5 neighbours", landmarks + UTM)
few = nearest("5 neighbours", landmarks[:10] + UTM)
local = nearest("local origin", landmarks[:10])
sys.exit(0 if many < 1e-6 and few > 0.009 and local < 1e-4 else 1)
EOF
