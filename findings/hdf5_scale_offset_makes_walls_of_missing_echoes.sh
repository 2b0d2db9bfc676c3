#!/usr/bin/env bash
# h5py 3.16.0 (HDF5 2.0.0): a missing echo comes back as the nearest wall, or no scan of the block does.
#
# Expected: HDF5's scale-offset filter with 3 digits keeps ranges to the millimetre in a third of the
# bytes, and takes floats as they are. ROS marks a beam that measured nothing by NaN. Its manual
# says that such values are not preserved; one expects to lose that beam, to 0 or to some number that
# no range has.
#
# What happens: numbers are kept as steps above the least of their block (chunk). A NaN becomes 0 steps:
# the beam that saw nothing comes back with the shortest range of all scans in its block, a wall or a
# person right ahead, where a window is. If it is the first value of a block, it is taken for the
# least and the largest too, and no comparison replaces it: the block is written without a
# complaint and cannot be read any more, a hundred scans for one beam. In float64 a NaN in that place
# is kept instead. An infinite range is kept in each place, but then its block is not compressed at all.
#
# Seen (100 scans of 360 beams, 1.2 to 10 m, in one block; what came back for that beam, and its bytes):
#   float32, all beams return         4.574 m   63022 bytes
#   float32, beam 5 is NaN            1.200 m   63022 bytes
#   float32, beam 5 is infinite         inf m  144021 bytes
#   float32, beam 0 is NaN          no scan can be read
#   float64, beam 5 is NaN            1.200 m   63022 bytes
#   float64, beam 0 is NaN              nan m  288021 bytes
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q --disable-pip-version-check --no-cache-dir \
    h5py==3.16.0 numpy==2.4.6
"$work/venv/bin/python" - "$work/scans.h5" <<'EOF'
import math
import sys

import h5py
import numpy as np

PATH, SHAPE = sys.argv[1], (100, 360)
RANGES = np.random.default_rng(5).uniform(1.2, 10, SHAPE)
NEAREST = RANGES.min()
CASES = [
    ("float32, all beams return", None, 5),
    ("float32, beam 5 is NaN", math.nan, 5),
    ("float32, beam 5 is infinite", math.inf, 5),
    ("float32, beam 0 is NaN", math.nan, 0),
    ("float64, beam 5 is NaN", math.nan, 5),
    ("float64, beam 0 is NaN", math.nan, 0),
]


def came_back(kind, value, beam):
    """Return what is read for one beam [m], None if nothing can be read, and the bytes kept."""
    scans = RANGES.astype(kind)
    if value is not None:
        scans[0, beam] = value
    with h5py.File(PATH, "w") as file:
        file.create_dataset("ranges", data=scans, chunks=SHAPE, scaleoffset=3)
    with h5py.File(PATH) as file:
        size = file["ranges"].id.get_storage_size()
        try:
            read = file["ranges"][:]
        except OSError:
            return None, size
    others = np.isfinite(scans)
    assert np.abs(read[others] - scans[others]).max() < 0.00051
    return float(read[0, beam]), size


seen = []
for name, value, beam in CASES:
    told, size = came_back(name.split(",")[0], value, beam)
    seen.append(told)
    shown = "no scan can be read" if told is None else f"{told:7.3f} m  {size:6} bytes"
    print(f"{name:30}  {shown}")
whole, wall, far, lost, wall64, kept = seen
same = (
    abs(whole - RANGES[0, 5]) < 0.001
    and max(abs(wall - NEAREST), abs(wall64 - NEAREST)) < 0.001
    and far == math.inf
    and lost is None
    and math.isnan(kept)
)
sys.exit(0 if same else 1)
EOF
