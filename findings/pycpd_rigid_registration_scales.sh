#!/usr/bin/env bash
# pycpd 2.0.0: RigidRegistration has a scale, and stretches a part of a wall to the whole of it.
#
# Expected: "rigid" is a rotation and a translation. A robot saw a part of a corner, 5 m of an 8 m
# wall and the 5 m wall beside it, and is registered to the whole corner: the part keeps its size.
# Where a scale is wanted or not, an option says so; as the constructor takes `scale=False` without
# complaint, that must be it.
#
# What happens: a scale is always estimated beside R and t, and is the third of the values that
# `get_registration_parameters` returns. Where one cloud covers only a part of the other, it grows
# to cover all of it. The constructor takes and drops any keyword, so `scale=False` changes
# nothing, and neither does a keyword with a typing mistake in it.
#
# Seen:
#   rigid motion wanted: scale 1
#   RigidRegistration():                 scale 1.607
#   RigidRegistration(scale=False):      scale 1.607
#   RigidRegistration(tolerence=1e-9):   scale 1.607
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q --disable-pip-version-check --no-cache-dir \
    pycpd==2.0.0 numpy==2.3.5
"$work/venv/bin/python" - <<'EOF'
import sys

import numpy as np
from pycpd import RigidRegistration

along, zero = np.linspace(0, 1, 100), np.zeros(100)
corner = np.concatenate([np.column_stack([8 * along, zero]), np.column_stack([zero, 5 * along])])
c, s = np.cos(0.1), np.sin(0.1)
part = corner[corner[:, 0] < 5] @ np.array([[c, -s], [s, c]]) + [0.2, 0.1]


def scale(**options):
    _, (found, _, _) = RigidRegistration(X=corner, Y=part, **options).register()
    return float(found)


print("rigid motion wanted: scale 1")
found = [scale(), scale(scale=False), scale(tolerence=1e-9)]
for said, one in zip(("()", "(scale=False)", "(tolerence=1e-9)"), found, strict=True):
    print(f"RigidRegistration{said + ':':20}scale {one:.3f}")
sys.exit(0 if all(abs(one - 1.607) < 0.01 for one in found) else 1)
EOF
