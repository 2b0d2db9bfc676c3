#!/usr/bin/env bash
# scipy 1.17.1 (and skimage 0.26.0 on top of it): the distance transform of a grid in which nothing
# is occupied measures distances to a wall that is not there.
#
# Expected: `distance_transform_edt` replaces each non-zero cell by its distance to the nearest zero
# cell. Where there is no zero cell, infinity, a huge number or an error are what one would guess,
# and what the two sister functions give (-1, and some 1e154): a likelihood field of an empty tile
# is then "far from everything".
#
# What happens: finite, smooth, plausible distances, from 1 in the first cell upwards: those to a
# cell at row -1, column 0, just outside the array. A robot in an empty hall sees an obstacle at a
# corner of the tile. The indices of "the nearest background cell" are (-1, 0), which NumPy takes
# for the last row. `skimage.morphology.medial_axis` of a hall that fills its tile returns the same
# distances.
#
# Seen:
#   first row of edt: [1.0, 1.414, 2.236, 3.162]; last row: [3.0, 3.162, 3.606, 4.243]
#   nearest zero cell of every cell: row -1, column 0
#   chamfer: [-1]; brute force: at least 1e154
#   medial_axis, first row: [1.0, 1.414, 2.236, 3.162]
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q --disable-pip-version-check --no-cache-dir \
    scipy==1.17.1 numpy==2.4.6 scikit-image==0.26.0
"$work/venv/bin/python" - <<'EOF'
import sys

import numpy as np
from scipy import ndimage
from skimage import morphology

free = np.ones((3, 4), bool)
distance, (row, column) = ndimage.distance_transform_edt(free, return_indices=True)
print(
    f"first row of edt: {distance[0].round(3).tolist()}; "
    f"last row: {distance[-1].round(3).tolist()}"
)
print(f"nearest zero cell of every cell: row {row.max()}, column {column.max()}")
chamfer = np.unique(ndimage.distance_transform_cdt(free)).tolist()
brute = ndimage.distance_transform_bf(free)
print(f"chamfer: {chamfer}; brute force: at least {brute.min():.0e}")
_, axis_distance = morphology.medial_axis(free, return_distance=True)
print(f"medial_axis, first row: {axis_distance[0].round(3).tolist()}")
i, j = np.indices(free.shape)
outside = np.allclose(distance, np.hypot(i + 1, j)) and (row == -1).all() and (column == 0).all()
same = outside and np.allclose(axis_distance, distance)
sys.exit(0 if same and chamfer == [-1] and brute.min() > 1e100 else 1)
EOF
