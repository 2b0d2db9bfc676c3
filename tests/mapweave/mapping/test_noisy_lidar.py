"""A lidar whose readings scatter far more than is assumed is mapped as such a one."""

from dataclasses import replace

import numpy as np
import pytest

from mapweave.config import Config, Sensor
from mapweave.mapping.mapper import Mapper, MapperParameters
from mapweave.maps import RobotMap
from mapweave.scan.scan import Scan
from tests.mapweave.buildings import BUILDING, tour, walls_of
from tests.mapweave.mapping.drives import scans_at

SIGMA = 0.06  # [m]
TOUR = np.array(list(tour([(2, 1), (13, 1), (13, -2)], 0.3)))


@pytest.fixture
def noisy(rng: np.random.Generator) -> list[Scan]:
    clean = scans_at(walls_of(BUILDING), TOUR, 0.1)
    return [replace(s, ranges=s.ranges + rng.normal(0, SIGMA, len(s.ranges))) for s in clean]


def mapped(mapper: Mapper, scans: list[Scan]) -> RobotMap:
    for scan in scans:
        mapper.add(scan)
    return mapper.finish()


def placed(robot_map: RobotMap) -> int:
    return sum(len(s.trajectory.scan_index) for s in robot_map.submaps)


def test_it_is_found_out_told_once_and_the_map_says_what_it_was_made_with(
    noisy: list[Scan],
) -> None:
    said: list[str] = []
    found = mapped(Mapper("a", on_warning=said.append), noisy)
    assert len(said) == 1
    assert "readings of a scatter by 0.0" in said[0]
    assert found.made_with is not None
    sigma = found.made_with.config["sensor"]["range_sigma"]
    assert sigma == pytest.approx(SIGMA, rel=0.3)
    assert {s.component for s in found.submaps} == {0}
    assert placed(found) >= 0.9 * len(noisy)


def test_it_is_mapped_as_if_it_had_been_said(noisy: list[Scan]) -> None:
    found = mapped(Mapper("a"), noisy)
    assert found.made_with is not None
    sigma = found.made_with.config["sensor"]["range_sigma"]
    assert isinstance(sigma, float)
    told = mapped(Mapper("a", config=Config(sensor=Sensor(range_sigma=sigma))), noisy)
    for one, other in zip(found.submaps, told.submaps, strict=True):
        np.testing.assert_array_equal(one.map.segments, other.map.segments)
        np.testing.assert_array_equal(one.trajectory.pose, other.trajectory.pose)


def test_what_somebody_has_set_stays(noisy: list[Scan]) -> None:
    said: list[str] = []
    config = Config(sensor=Sensor(range_sigma=0.02))
    mapped(Mapper("a", config=config, on_warning=said.append), noisy[:8])
    mapped(Mapper("a", parameters=MapperParameters(patience=6), on_warning=said.append), noisy[:8])
    assert not said
