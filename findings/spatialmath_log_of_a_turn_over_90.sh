#!/usr/bin/env bash
# spatialmath-python 1.1.18: the logarithm of a planar motion that turns by more than 90° is another
# motion's.
#
# Expected: exp(log(T)) is T for each rigid motion of the plane, as it is for SE(3); a turn of 180°
# may come back as -180°, no other.
#
# What happens: the turn is found by the arc tangent of one quotient, so it comes back modulo 180°:
# 120° as -60°, 180° as nothing at all. The translation is solved with that other turn, so the whole
# motion differs, by metres. Nothing is raised. The same motion as SE3 is right, and interpolation
# between SE2 poses (which does not take the logarithm) as well. A pose graph whose errors stay under
# 90° never shows it; a robot that turns round in a corridor does.
#
# Seen:
#   89.0° at (1.00, 2.00) -> 89.0° at (1.00, 2.00)
#   91.0° at (1.00, 2.00) -> -89.0° at (-1.97, 0.98)
#   150.0° at (1.00, 2.00) -> -30.0° at (-0.54, 0.27)
#   180.0° at (1.00, 2.00) -> -0.0° at (1.00, 2.00)
#   in SE(3): 150.0° at (1.00, 2.00) -> 150.0° at (1.00, 2.00)
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q --disable-pip-version-check --no-cache-dir \
    spatialmath-python==1.1.18
"$work/venv/bin/python" - <<'EOF'
import math
import sys

from spatialmath import SE2, SE3


def there_and_back(degrees):
    motion = SE2.Exp(SE2(1, 2, degrees, unit="deg").log())
    x, y, theta = motion.xyt()
    return x, y, math.degrees(theta)


def in_space(degrees):
    motion = SE3.Exp((SE3.Trans(1, 2, 0) * SE3.Rz(degrees, unit="deg")).log())
    return motion.t[0], motion.t[1], motion.rpy(unit="deg")[2]


def told(degrees, found):
    x, y, turned = found
    return f"{degrees:.1f}° at (1.00, 2.00) -> {turned:.1f}° at ({x:.2f}, {y:.2f})"


found = {degrees: there_and_back(degrees) for degrees in (89, 91, 150, 180)}
for degrees, motion in found.items():
    print(told(degrees, motion))
print("in SE(3):", told(150, in_space(150)))
turned = {degrees: round(motion[2]) for degrees, motion in found.items()}
as_seen = turned == {89: 89, 91: -89, 150: -30, 180: 0} and round(in_space(150)[2]) == 150
sys.exit(0 if as_seen else 1)
EOF
