"""Lidars of all kinds write logs that are read as their makers mean them."""

import json
from pathlib import Path

import numpy as np
import pytest

from mapweave.errors import MapweaveError
from mapweave.geometry.arrays import FloatArray
from mapweave.io.readers import read_scans
from mapweave.scan.scan import Scan
from mapweave_deploy.sim.lidars import LIDARS
from mapweave_deploy.sim.simulation import scan_line, simulate

RANGES = np.random.default_rng(1).uniform(0.5, 3.0, 800)


def read_back(kind: str, folder: Path, ranges: FloatArray) -> Scan:
    """Return the scan that is read of a line of that lidar."""
    log = folder / f"{kind}.log"
    log.write_text(scan_line(ranges, 0.0, LIDARS[kind].parameters))
    (scan,) = read_scans(log, on_warning=pytest.fail)
    return scan


@pytest.mark.parametrize("kind", [kind for kind in LIDARS if kind != "mirrored"])
def test_what_a_lidar_measured_is_read_whichever_way_round_it_turns(
    kind: str, tmp_path: Path
) -> None:
    lidar = LIDARS[kind].parameters
    scan = read_back(kind, tmp_path, RANGES[: lidar.beams])
    np.testing.assert_allclose(scan.angles, lidar.angles, atol=1e-4)
    np.testing.assert_allclose(scan.ranges, RANGES[: lidar.beams], atol=1e-3)


def test_a_lidar_that_hangs_upside_down_without_saying_so_sees_a_mirrored_world(
    tmp_path: Path,
) -> None:
    lidar = LIDARS["mirrored"].parameters
    scan = read_back("mirrored", tmp_path, RANGES[: lidar.beams])
    np.testing.assert_allclose(scan.angles, -lidar.angles[::-1], atol=1e-4)
    np.testing.assert_allclose(scan.ranges, RANGES[: lidar.beams][::-1], atol=1e-3)


def test_kinds_differ_in_view_reach_rate_noise_and_order() -> None:
    kinds = [lidar.parameters for lidar in LIDARS.values()]
    assert {round(np.degrees(k.field_of_view / 90)) for k in kinds} == {2, 3, 4}
    assert len({k.maximum_range for k in kinds}) >= 5
    assert {k.order for k in kinds} == {"counter-clockwise", "clockwise", "mirrored"}
    assert len({lidar.rate for lidar in LIDARS.values()}) >= 5
    assert len({k.noise for k in kinds}) >= 2


def test_a_team_drives_with_the_lidar_it_is_given(tmp_path: Path) -> None:
    (log,) = simulate("arena", 1, 1, tmp_path, lidar="ld06")
    scans = list(read_scans(log.log, on_warning=pytest.fail))
    assert len(scans) == len(json.loads(log.truth.read_text())["poses"])
    assert {len(scan.angles) for scan in scans} == {450}
    assert np.median(np.diff([scan.stamp for scan in scans])) == pytest.approx(0.1)
    with pytest.raises(MapweaveError, match="no lidar 'sonar'; there are utm, lms"):
        simulate("arena", 1, 1, tmp_path, lidar="sonar")
