#!/usr/bin/env bash
# scipy 1.17.1: scipy.signal.correlate of two uint8 grids wraps its sums at 256, even by FFT.
#
# Expected: matching one occupancy mask against another counts the cells in common, and the peak is
# where they coincide. Masks are uint8, as every image reader gives them. The documentation defines
# the result as a sum of products, offers `method="fft"` as a faster way to the same, and says of
# integers only that the direct way is taken where rounding could lose precision; nothing is said
# of the type of the result. FFTs compute in floats, so counts above 255 look safe: the neighbour
# `fftconvolve` gives them.
#
# What happens: the result is cast back to the type of the inputs. At the true place 1200 cells
# coincide and 176 is reported; the highest value is elsewhere. Small masks (under 256 cells) work,
# so tests with toy grids pass. Signed bytes wrap to below zero.
#
# Seen:
#   true place (50, 50): 1200 cells in common; correlate says 176 (auto), 176 (direct), 176 (fft)
#   peak of correlate: 255 at (35, 27); peak of fftconvolve: 1200 at (50, 50)
#   int8: -80
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q --disable-pip-version-check --no-cache-dir \
    scipy==1.17.1 numpy==2.4.6
"$work/venv/bin/python" - <<'EOF'
import sys

import numpy as np
from scipy import signal

grid = np.zeros((300, 300), np.uint8)
grid[50:80, 50:90] = 1
patch = grid[50:80, 50:90]
by_method = {
    method: signal.correlate(grid, patch, mode="valid", method=method)
    for method in ("auto", "direct", "fft")
}
said = {method: int(values[50, 50]) for method, values in by_method.items()}
listed = ", ".join(f"{value} ({method})" for method, value in said.items())
print(f"true place (50, 50): {int(patch.sum())} cells in common; correlate says {listed}")


def peak(values):
    place = np.unravel_index(values.argmax(), values.shape)
    return round(float(values.max())), tuple(int(i) for i in place)


wrong, where = peak(by_method["auto"])
right, there = peak(signal.fftconvolve(grid, patch[::-1, ::-1], mode="valid").round())
print(f"peak of correlate: {wrong} at {where}; peak of fftconvolve: {right} at {there}")
signed = int(signal.correlate(grid.astype(np.int8), patch.astype(np.int8), mode="valid")[50, 50])
print(f"int8: {signed}")
same = set(said.values()) == {1200 % 256} and where != (50, 50)
sys.exit(0 if same and (right, there) == (1200, (50, 50)) and signed < 0 else 1)
EOF
