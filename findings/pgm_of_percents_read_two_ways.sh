#!/usr/bin/env bash
# Pillow 13.0.0 and OpenCV 4.12.0: one map, two occupancies.
#
# Expected: a PGM whose largest value is 100, as an occupancy grid written in per cent has it
# (map_server's mode "raw" takes pixels for per cents), is read as 0, 50 and 100 by both.
#
# What happens: the format leaves it to the reader what the largest value stands for. Pillow
# stretches 0..100 to 0..255 (and scikit-image and imageio, which read with it); OpenCV gives the
# bytes. A cell of 50 % is 128 to one and 50 to the other, and a full one is 255, which mode "raw"
# takes for unknown. Neither has a way to ask which it did.
#
# Seen:
#   in the file: [0, 50, 100] of 100
#   Pillow:      [0, 128, 255]
#   OpenCV:      [0, 50, 100]
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q --disable-pip-version-check --no-cache-dir \
    pillow==13.0.0 opencv-python-headless==4.12.0.88 'numpy<2.3'
"$work/venv/bin/python" - "$work/grid.pgm" <<'EOF'
import sys
from pathlib import Path

import cv2
import numpy as np
from PIL import Image

grid = Path(sys.argv[1])
grid.write_bytes(b"P5\n3 1\n100\n" + bytes([0, 50, 100]))
by_pillow = np.asarray(Image.open(grid)).ravel().tolist()
by_opencv = cv2.imread(str(grid), cv2.IMREAD_UNCHANGED).ravel().tolist()
print("in the file: [0, 50, 100] of 100")
print(f"Pillow:      {by_pillow}")
print(f"OpenCV:      {by_opencv}")
sys.exit(0 if by_pillow == [0, 128, 255] and by_opencv == [0, 50, 100] else 1)
EOF
