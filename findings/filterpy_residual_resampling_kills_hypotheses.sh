#!/usr/bin/env bash
# filterpy 2.0.0: residual_resample drops all particles lighter than the average, whatever they weigh
# together.
#
# Expected: residual resampling makes floor(N w) copies of a particle of weight w, and draws what is
# missing by the fractions that were cut off. On average each has N w copies, as by the package's
# other methods, with less noise. A robot that may be in either of two rooms that look alike, by 60% to
# 40%, may be in either afterwards.
#
# What happens: the copies are taken off the weights, not off N times the weights. What is left is
# negative wherever a copy was made; divided by its negative sum it makes those that have copies
# already the likely ones, and gives those without a step down in a running sum that should only rise.
# What weighs less than 1/N is never drawn: in one step the second room is empty, and with it four
# tenths of the belief. The filter looks sure, and nothing is raised. bayesian-filters 1.4.5 has it too.
#
# Seen (1000 particles, half of them in each room, 60% and 40% of the weight):
#   multinomial_resample   608 to 392
#   residual_resample     1000 to   0
#   stratified_resample    600 to 400
#   systematic_resample    600 to 400
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q --disable-pip-version-check --no-cache-dir \
    filterpy==2.0.0 bayesian-filters==1.4.5 numpy==2.4.6 scipy==1.17.1
"$work/venv/bin/python" - <<'EOF'
import importlib
import sys

import numpy as np

COUNT, SHARES = 1000, (0.6, 0.4)
ROOM = np.repeat([0, 1], COUNT // 2)
WEIGHTS = np.array(SHARES)[ROOM] / (COUNT // 2)
METHODS = ["multinomial", "residual", "stratified", "systematic"]
ROUNDS = 20


def in_rooms(package, method):
    """Return how many particles are in each room after resampling, on average."""
    resample = getattr(importlib.import_module(f"{package}.monte_carlo"), f"{method}_resample")
    np.random.seed(0)
    kept = sum(np.bincount(ROOM[resample(WEIGHTS)], minlength=2) for _ in range(ROUNDS))
    return kept / ROUNDS


seen = {method: in_rooms("filterpy", method) for method in METHODS}
for method, (first, second) in seen.items():
    print(f"{method + '_resample':20} {first:5.0f} to {second:3.0f}")
_, dead = seen.pop("residual")
right = all(abs(second - SHARES[1] * COUNT) < 20 for _, second in seen.values())
also = in_rooms("bayesian_filters", "residual")[1]
sys.exit(0 if right and dead == also == 0 else 1)
EOF
