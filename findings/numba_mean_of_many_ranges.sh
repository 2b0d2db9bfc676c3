#!/usr/bin/env bash
# numba 0.68.1: compiling a function changes the mean of float32 ranges, from 10.00 m to 9.34 m.
#
# Expected: numba lists `sum` and `mean` of arrays among what it supports of NumPy, whose float32
# sums are pairwise, so that ten million of them still give six digits. The compiled function even
# returns a Python float, a double, which looks as if it had summed in one.
#
# What happens: the compiled sum is one float32 to which element after element is added. As it
# grows, its last bit outgrows what is added: at 67 million metres it is 4 m to 8 m, and ranges of
# 10 m go in as 8 or 12. A mean over 72 000 ranges (a hundred scans) is still right to a tenth of a
# millimetre; over ten million it is 66 cm short. The same function without @njit is right, so tests
# without numba, or with few points, pass.
#
# Seen (ranges between 9.9 m and 10.1 m):
#      72000 ranges: compiled 10.0001 m, NumPy 10.0001 m
#   10000000 ranges: compiled 9.3420 m, NumPy 10.0000 m; type of the result: float
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q --disable-pip-version-check --no-cache-dir \
    numba==0.68.1 numpy==2.4.6
"$work/venv/bin/python" - <<'EOF'
import sys

import numba
import numpy as np


def mean(ranges):
    return ranges.mean()


compiled = numba.njit(mean)
ranges = np.random.default_rng(0).uniform(9.9, 10.1, 10_000_000).astype(np.float32)
few, many = ranges[:72_000], ranges
print("ranges between 9.9 m and 10.1 m:")
print(f"{len(few):8} ranges: compiled {compiled(few):.4f} m, NumPy {mean(few):.4f} m")
wrong, right = compiled(many), mean(many)
print(
    f"{len(many):8} ranges: compiled {wrong:.4f} m, NumPy {right:.4f} m; "
    f"type of the result: {type(wrong).__name__}"
)
near = abs(compiled(few) - 10) < 1e-3 and abs(right - 10) < 1e-3
sys.exit(0 if near and abs(wrong - 10) > 0.3 else 1)
EOF
