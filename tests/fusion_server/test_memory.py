"""What is free does not stay with the process."""

import os
from pathlib import Path

import numpy as np
import pytest

from mapweave_fusion_server.memory import give_back

MIB = 2**20
PIECE = MIB // 16  # below what the C library asks the system for by itself


def _resident() -> float:
    """Memory of this process [MiB]."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / MIB


def test_holes_between_what_stays_go_back_to_the_system() -> None:
    if not give_back():
        pytest.skip("needs glibc")
    pieces = [np.ones(PIECE, dtype=np.uint8) for _ in range(64 * 16)]
    kept = pieces[::2]
    before = _resident()
    pieces.clear()
    give_back()
    assert _resident() < before - 16
    assert all(piece.all() for piece in kept)
