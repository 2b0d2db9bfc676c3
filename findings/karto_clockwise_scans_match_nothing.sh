#!/usr/bin/env bash
# karto-scanmatcher 1.0.0: nothing is ever matched to a scan that was read clockwise.
#
# Expected: a scan tells its first angle, its last and the step between two beams. Of a lidar that turns
# clockwise, or is mounted upside down, the step is negative, as ROS allows. Its points are the same as
# if its beams were listed the other way round, and so is what a matcher makes of them.
#
# What happens: of the scans that are matched to, those points are kept whose wall faces the viewer. Which
# side a wall faces is taken from the order of its points, and they are taken to be counterclockwise: of
# a clockwise scan each wall shows its back, and no point is left. The answer is the guess that
# was given, with a response of 0. So each scan is put where odometry says, loops stay open, and the
# map looks as if matching were off. The scan that is matched is not looked at in that way: there the
# order does not count and the answer is right.
#
# Seen (0.10 m ahead and 0.05 m to the left of where the first scan was; guess: at the first scan):
#   matched counterclockwise, to counterclockwise:  0.10  0.05, response 0.98
#   matched clockwise,        to counterclockwise:  0.10  0.05, response 0.98
#   matched counterclockwise, to clockwise:         0.00  0.00, response 0.00
#   matched clockwise,        to clockwise:         0.00  0.00, response 0.00
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q --disable-pip-version-check --no-cache-dir \
    karto-scanmatcher==1.0.0 numpy==2.4.6
"$work/venv/bin/python" - <<'EOF'
import sys

import numpy as np
from karto_scanmatcher import (
    LaserScanConfig,
    LocalizedRangeScan,
    Pose2,
    ScanMatcherConfig,
    Wrapper,
)

BEAMS, HALF, FAR = 720, 0.75 * np.pi, 20.0
WALLS = np.array([[-3.0, -2.0], [5.0, 4.0]])  # of a room along x and y [m]
OPTIONS = {
    "angle_variance_penalty": 0.3,
    "distance_variance_penalty": 0.5,
    "coarse_search_angle_offset": 0.349,
    "coarse_angle_resolution": 0.0349,
    "fine_search_angle_resolution": 0.00349,
    "use_response_expansion": True,
    "range_threshold": FAR,
    "minimum_angle_penalty": 0.9,
    "search_size": 0.5,
    "resolution": 0.01,
    "smear_deviation": 0.05,
}


def scan(x, y, way):
    """Return what is seen of the room from (x, y) [m], guessed to be at the origin."""
    angles = way * np.linspace(-HALF, HALF, BEAMS)
    ahead = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    reach = (np.where(ahead > 0, WALLS[1], WALLS[0]) - (x, y)) / ahead
    step = way * 2 * HALF / (BEAMS - 1)
    kind = LaserScanConfig(angles[0], angles[-1], step, 0.05, FAR, FAR, "")
    there = Pose2(0, 0, 0)
    return LocalizedRangeScan(kind, list(reach.min(axis=1)), there, there, 0, 0.0)


config = ScanMatcherConfig()
for name, value in OPTIONS.items():
    setattr(config, name, value)
matcher = Wrapper(config)
ways = {"counterclockwise": 1, "clockwise": -1}
seen = []
for to, base in ways.items():
    for name, way in ways.items():
        result = matcher.match_scan(scan(0.1, 0.05, way), [scan(0, 0, base)], True, True)
        pose = result.best_pose
        seen.append([pose.x, pose.y, result.response])
        told = f"matched {name + ',':17} to {to + ':':17} {pose.x:5.2f} {pose.y:5.2f}"
        print(f"{told}, response {result.response:.2f}")
expected = [[0.1, 0.05, 0.98]] * 2 + [[0, 0, 0]] * 2
sys.exit(0 if np.allclose(seen, expected, atol=0.01) else 1)
EOF
