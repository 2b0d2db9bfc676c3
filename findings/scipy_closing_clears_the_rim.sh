#!/usr/bin/env bash
# scipy 1.17.1: binary_closing of a grid map clears the cells on its rim, walls included.
#
# Expected: closing is dilation followed by erosion, and by its definition takes no set cell away
# (it is extensive): that is why one closes the gaps of a wall with it. The documentation says it
# fills holes smaller than the structuring element, and of `border_value` only that it is the value
# at the border in the output. skimage's closing leaves every set cell set.
#
# What happens: for both steps what lies outside the array is `border_value`, 0 by default. The
# dilation cannot grow outwards, and the erosion then eats inwards: whatever is set on the rim is
# cleared. A grid cut to the bounding box of its walls, as maps are, loses its outer walls and gets
# nothing for it. border_value=1 is no cure: then the dilation grows in from outside, and with
# enough iterations a grid with a single block in the middle comes back full.
#
# Seen:
#   9 x 9 grid, a wall on the rim (32 cells), a block of 9 within: 41 set
#   scipy, closed once: 0 of 32 of the rim left; skimage: 32 of 32
#   block alone, border_value=1, 2 iterations: 81 cells set for 9
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

cross = ndimage.generate_binary_structure(2, 1)
rim = np.ones((9, 9), bool)
rim[1:-1, 1:-1] = False
block = np.zeros((9, 9), bool)
block[3:6, 3:6] = True
grid = rim | block
print(
    f"9 x 9 grid, a wall on the rim ({rim.sum()} cells), a block of {block.sum()} within: "
    f"{grid.sum()} set"
)
closed = ndimage.binary_closing(grid, cross)
other = morphology.closing(grid, cross)
left, kept = int((closed & rim).sum()), int((other & rim).sum())
print(f"scipy, closed once: {left} of {rim.sum()} of the rim left; skimage: {kept} of {rim.sum()}")
bordered = ndimage.binary_closing(block, cross, iterations=2, border_value=1)
print(f"block alone, border_value=1, 2 iterations: {bordered.sum()} cells set for {block.sum()}")
sys.exit(0 if (left, kept) == (0, 32) and bordered.sum() > 2 * block.sum() else 1)
EOF
