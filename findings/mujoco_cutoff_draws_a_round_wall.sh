#!/usr/bin/env bash
# mujoco 4.0.0: a rangefinder's cutoff turns what is too far away into a wall at the cutoff.
#
# Expected: a beam that hits nothing reads -1. A `cutoff` of 10 m is the lidar's reach, so a beam
# whose wall is farther away has no echo either, and reads -1 as well.
#
# What happens: -1 is for beams that leave the world only. The cutoff is applied to the reading after
# the search, as to every sensor's, so each farther wall reads exactly 10 m: one lidar has two
# writings of "nothing in reach", and one of them is a valid distance. Drawn as it comes, a hall in
# which nothing is in reach is a round room of 10 m, which goes with the robot wherever it drives.
# Who passes the scans on has to name the cutoff as their range_max, as well as leave out the -1.
#
# Seen (a robot in the middle of a hall of 30 m, whose one side is open; 360 beams):
#   without a cutoff   89 read -1, the others 14.9 to 21.1 m
#   cutoff 10 m        89 read -1, 271 read 10 m, though no wall is nearer than 14.9 m
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q --disable-pip-version-check --no-cache-dir \
    mujoco==4.0.0 numpy==2.4.6
"$work/venv/bin/python" - <<'EOF'
import sys

import mujoco
import numpy as np

HALF = 15.0  # of the hall [m]
WALLS = ((HALF, 0, 0.1, HALF), (-HALF, 0, 0.1, HALF), (0, HALF, HALF, 0.1))  # middles, half sizes
ANGLES = np.radians(np.arange(360))


def readings(cutoff):
    """The 360 ranges [m] of a robot in the middle of the hall; a cutoff of 0 is none."""
    walls = [f'<geom type="box" pos="{x} {y} 0" size="{a} {b} 2"/>' for x, y, a, b in WALLS]
    beams = [f'<site name="b{i}" zaxis="{np.cos(a)} {np.sin(a)} 0"/>' for i, a in enumerate(ANGLES)]
    lidar = [f'<rangefinder site="b{i}" cutoff="{cutoff}"/>' for i in range(len(ANGLES))]
    world = f"<worldbody>{''.join(walls)}<body>{''.join(beams)}</body></worldbody>"
    model = mujoco.MjModel.from_xml_string(
        f"<mujoco>{world}<sensor>{''.join(lidar)}</sensor></mujoco>"
    )
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return data.sensordata


plain, short = readings(0), readings(10)
far = plain[plain >= 0]
print(f"without a cutoff  {np.sum(plain == -1):3} read -1, the others {far.min():.1f} to {far.max():.1f} m")
print(f"cutoff 10 m       {np.sum(short == -1):3} read -1, {np.sum(short == 10):3} read 10 m")
none = plain == -1
sys.exit(0 if far.min() > 14 and np.all(short[none] == -1) and np.all(short[~none] == 10) else 1)
EOF
