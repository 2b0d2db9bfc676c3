"""Loops close in another process: the map is the same, and mapping goes on when it dies."""

import os
import signal
from dataclasses import astuple
from pathlib import Path

import numpy as np
import pytest

from mapweave.io.map_files import write_map
from mapweave.mapping.mapper import Mapper, MapperParameters
from mapweave.scan.scan import Scan
from mapweave_agent.backend_process import BackendProcess
from tests.mapweave.buildings import BUILDING, FRONT, cast, tour, walls_of

THERE_AND_BACK = [(1, 1), (3.5, 1), (3.5, -2), (3.5, 1), (13, 1), (3.5, 1), (3.5, -2), (3.5, 1)]
PARAMETERS = MapperParameters()


@pytest.fixture
def scans() -> list[Scan]:
    rng = np.random.default_rng(7)
    return [
        cast(walls_of(BUILDING), pose, index=k, angles=FRONT, noise=rng)
        for k, pose in enumerate(tour(THERE_AND_BACK, 0.5))
    ]


def test_the_map_is_the_same_to_the_byte_wherever_it_settles(
    scans: list[Scan], tmp_path: Path
) -> None:
    here = Mapper("a", parameters=PARAMETERS)
    with BackendProcess(PARAMETERS.backend) as backend:
        beside = Mapper("a", parameters=PARAMETERS, backend=backend)
        for scan in scans:
            np.testing.assert_equal(astuple(here.add(scan)), astuple(beside.add(scan)))
        for name, mapper in (("here", here), ("beside", beside)):
            write_map(tmp_path / name, mapper.finish())
    assert len(here.robot_map().submaps) > 2
    assert (tmp_path / "here").read_bytes() == (tmp_path / "beside").read_bytes()


def test_without_the_process_submaps_stay_as_tracked(scans: list[Scan]) -> None:
    with BackendProcess(PARAMETERS.backend) as backend:
        mapper = Mapper("a", parameters=PARAMETERS, backend=backend)
        for scan in scans[: len(scans) // 2]:
            mapper.add(scan)
        os.kill(backend.pid, signal.SIGKILL)
        for scan in scans[len(scans) // 2 :]:
            mapper.add(scan)
        found = mapper.finish()
    placed = np.concatenate([s.trajectory.scan_index for s in found.submaps])
    assert sorted(placed) == list(range(len(scans)))
