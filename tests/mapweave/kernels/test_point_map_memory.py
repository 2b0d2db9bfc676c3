"""What a compiled point map takes in memory: robots and coordinator keep a hundred of them."""

import gc
import sys
from pathlib import Path

import numpy as np
import pytest

from mapweave.kernels.loading import COMPILED
from mapweave.kernels.point_map import PointMap, make_point_map

pytestmark = pytest.mark.skipif(
    COMPILED is None or not sys.platform.startswith("linux"), reason="no compiled kernels, no /proc"
)
MAPS, SIDE, CELL = 24, 60.0, 0.2  # and [m]


def resident() -> float:
    """Memory of this process [MiB]."""
    gc.collect()
    return int(Path("/proc/self/statm").read_text().split()[1]) * 4096 / 2**20


def wide_map(rng: np.random.Generator) -> PointMap:
    points, angle = rng.uniform(0, SIDE, (200, 2)), rng.uniform(-np.pi, np.pi, 200)
    points[:2] = [0, 0], [SIDE, SIDE]
    made = make_point_map(0.4, CELL, 0.0, 1)
    made.add(points, np.column_stack([np.cos(angle), np.sin(angle)]), None)
    return made


def test_the_cells_of_a_map_that_hold_no_point_take_a_few_bytes_each() -> None:
    rng = np.random.default_rng(0)
    wide_map(rng)
    before = resident()
    made = [wide_map(rng) for _ in range(MAPS)]
    cells = len(made) * (SIDE / CELL) ** 2
    # The grid may be twice as long and wide as what it holds.
    assert (resident() - before) * 2**20 < 4 * 8 * cells
