#!/usr/bin/env bash
# opencv-python-headless 4.12.0.88 (5.0.0.93 does the same): a template without any structure fits
# everywhere, with the highest score there is.
#
# Expected: TM_CCOEFF_NORMED is the correlation coefficient of template and window, between -1 and
# 1; the documentation gives its formula. For a patch in which all cells are equal numerator and
# denominator are both zero, so 0 ("says nothing") or NaN is what one would guess, and 0 is what one
# gets if it is the window that is flat, and from `skimage.feature.match_template` for both.
#
# What happens: 1.0 for each and every place. A patch of a grid map that is all unknown (205), or
# all free, beats every real match, and `minMaxLoc` reports a perfect hit at (0, 0). A threshold on
# the score lets exactly the useless patches pass. The same call with a mask that covers the whole
# patch gives NaN throughout.
#
# Seen:
#   flat patch: scores 1.0 to 1.0, best at (0, 0)
#   a patch cut from the map: 1.0 at (30, 12); flat window under it: 0.0
#   skimage, flat patch: 0.0 to 0.0
#   flat patch with a mask of ones: 100 % NaN
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q --disable-pip-version-check --no-cache-dir \
    opencv-python-headless==4.12.0.88 scikit-image==0.26.0 numpy==2.2.6
"$work/venv/bin/python" - <<'EOF'
import sys

import cv2
import numpy as np
from skimage.feature import match_template

grid = np.random.default_rng(0).choice(np.array([0, 205, 254], np.uint8), (60, 60))
grid[10:30, 10:30] = 205
flat = np.full((8, 8), 205, np.uint8)
scores = cv2.matchTemplate(grid, flat, cv2.TM_CCOEFF_NORMED)
place = cv2.minMaxLoc(scores)[3]
print(f"flat patch: scores {scores.min()} to {scores.max()}, best at {place}")

patch = grid[30:38, 12:20]
found = cv2.matchTemplate(grid, patch, cv2.TM_CCOEFF_NORMED)
best = tuple(int(i) for i in np.unravel_index(found.argmax(), found.shape))
print(
    f"a patch cut from the map: {found.max().round(5)} at {best}; "
    f"flat window under it: {found[15, 15]}"
)
other = match_template(grid, flat)
print(f"skimage, flat patch: {other.min()} to {other.max()}")
masked = cv2.matchTemplate(grid, flat, cv2.TM_CCOEFF_NORMED, mask=np.ones_like(flat))
print(f"flat patch with a mask of ones: {100 * np.isnan(masked).mean():.0f} % NaN")
same = (scores == 1).all() and found[15, 15] == 0 and best == (30, 12)
sys.exit(0 if same and (other == 0).all() and np.isnan(masked).all() else 1)
EOF
