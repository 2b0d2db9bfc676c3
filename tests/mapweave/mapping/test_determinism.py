"""The same log gives the same map on every run, whatever a process was seeded with."""

import os
import subprocess
import sys
from pathlib import Path

import pytest


def map_in_a_process(log: Path, output: Path, scans: str, hash_seed: str) -> bytes:
    """Return the bytes of the map that a process of its own makes of `scans` of `log`."""
    subprocess.run(
        [sys.executable, "-m", "mapweave", "map", log, "--scans", scans, "--output", output],
        env={**os.environ, "PYTHONHASHSEED": hash_seed},
        check=True,
        capture_output=True,
        timeout=600,
    )
    return output.read_bytes()


def check(log: Path, folder: Path, scans: str) -> None:
    once, again = (
        map_in_a_process(log, folder / f"{seed}.json", scans, seed) for seed in ("1", "4242")
    )
    assert once == again
    assert b'"trajectory"' in once


def test_two_processes_make_the_same_map_of_a_stretch_to_the_byte(
    data_dir: Path, tmp_path: Path
) -> None:
    """Sets and dictionaries are ordered differently in the two; the map is not."""
    check(data_dir / "intel.log.gz", tmp_path, "0:60")


@pytest.mark.slow
def test_two_processes_make_the_same_map_of_a_log_with_loops_to_the_byte(
    data_dir: Path, tmp_path: Path
) -> None:
    check(data_dir / "seattle.log.gz", tmp_path, "0:241")
