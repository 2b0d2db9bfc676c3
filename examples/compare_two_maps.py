"""Tell whether two robots' maps show one place: ``python compare_two_maps.py A.json B.json``."""

import sys

import numpy as np

import mapweave

if len(sys.argv) != 3:
    raise SystemExit("usage: python compare_two_maps.py A.json B.json")
try:
    reference, other = (mapweave.load(path) for path in sys.argv[1:])
except mapweave.MapweaveError as error:  # one line that names the file
    raise SystemExit(f"{error}") from error
if not (isinstance(reference, mapweave.RobotMap) and isinstance(other, mapweave.RobotMap)):
    raise SystemExit("expected the maps of two robots, got a joint map")

for alignment in mapweave.align(reference, other):
    x, y, theta = alignment.transform  # takes coordinates in the other to those in the reference
    print(f"{alignment.reference} - {alignment.other}: {alignment.decision}")
    print(f"  {alignment.reason}")
    if alignment.decision == "accepted":
        print(
            f"  {alignment.other} lies at {x:.2f} m, {y:.2f} m, {np.degrees(theta):.1f}°"
            f" in {alignment.reference}, with a confidence of {alignment.confidence:.3f}"
        )
