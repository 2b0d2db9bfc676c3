"""What agents begin with a stored map: beside tracking, in processes, and the same as at rest."""

import os
import signal
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import mapweave_agent
from mapweave.commands.starting import Start
from mapweave.config import Config
from mapweave.errors import ArgumentError
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.io.map_files import read_map, save, write_map
from mapweave.io.readers import read_scans
from mapweave.mapping.localization.known_map import KnownMap
from mapweave.mapping.localization.localizer import Localizer
from mapweave.mapping.localization.place_finder import PlaceFinderParameters
from mapweave.mapping.mapper import Mapper
from mapweave.maps import RobotMap
from mapweave.scan.scan import Scan
from mapweave_agent.stored.mappers import mapper_of
from mapweave_agent.stored.place_process import PlaceProcess
from mapweave_protocol.link.session import open_session
from tests.agent.test_agent import MAPWEAVE, PATIENCE, Listener
from tests.mapweave.buildings import BUILDING, scans_along

THERE = [(3, 1), (13, 1), (13, -3), (13, 1), (18, 1), (18, 4), (18, 1), (28, 1)]


def scans(seed: int, first: int = 0) -> list[Scan]:
    return scans_along(BUILDING, THERE, seed, first=first)[0]


@pytest.fixture(scope="module")
def known() -> RobotMap:
    mapper = Mapper("a")
    for scan in scans(1):
        mapper.add(scan)
    return mapper.finish()


def test_the_map_that_goes_on_is_the_same_to_the_byte_beside_and_here(
    known: RobotMap, tmp_path: Path
) -> None:
    here = Mapper("a", known=known)
    with mapper_of(Start(known=known), "a", "0", Config(), live=False) as beside:
        for scan in scans(2, 500):
            here.add(scan)
            beside.add(scan)
        save(here.finish(), tmp_path / "here")
        save(beside.finish(), tmp_path / "beside")
    assert here.robot_map().components == [0]
    assert (tmp_path / "here").read_bytes() == (tmp_path / "beside").read_bytes()


def test_the_robot_finds_itself_the_same_beside_and_here(known: RobotMap, tmp_path: Path) -> None:
    place = KnownMap.of(known)
    here = Localizer(place, "a")
    with mapper_of(Start(place=place), "a", "0", Config(), live=False) as beside:
        for scan in scans(2)[:40]:
            here.add(scan)
            beside.add(scan)
        save(here.finish(), tmp_path / "here")
        save(beside.finish(), tmp_path / "beside")
    assert here.place is not None
    assert (tmp_path / "here").read_bytes() == (tmp_path / "beside").read_bytes()


def test_a_live_robot_waits_for_no_search(known: RobotMap) -> None:
    """The process that searches is stopped: scans are tracked on."""
    place = KnownMap.of(known)
    with PlaceProcess(place, PlaceFinderParameters()) as searcher:
        localizer = Localizer(place, searcher=searcher, live=True)
        os.kill(searcher.pid, signal.SIGSTOP)
        for scan in scans(2)[:30]:
            assert not localizer.add(scan).placed
        os.kill(searcher.pid, signal.SIGCONT)
        deadline = time.monotonic() + PATIENCE
        while not searcher.is_ready and time.monotonic() < deadline:
            time.sleep(0.02)
        for scan in scans(2)[30:60]:
            localizer.add(scan)
            time.sleep(0.05)
        assert localizer.place is not None


def test_without_the_process_nothing_is_found_and_tracking_goes_on(known: RobotMap) -> None:
    place = KnownMap.of(known)
    with PlaceProcess(place, PlaceFinderParameters()) as searcher:
        localizer = Localizer(place, searcher=searcher)
        os.kill(searcher.pid, signal.SIGKILL)
        assert not any(localizer.add(scan).placed for scan in scans(2)[:40])


def test_an_agent_that_localizes_tells_where_it_was_in_the_stored_map_and_none_of_its_walls(
    endpoint: str, team: str, logs: list[Path], tmp_path: Path
) -> None:
    stored, scans_there = tmp_path / "stored.json", list(read_scans(logs[0]))
    mapper = Mapper("old")
    for scan in scans_there:
        mapper.add(scan)
    write_map(stored, mapper.finish())
    where = ["--robot", "b", "--team", team, "--connect", endpoint, "--log", str(logs[0])]
    where += ["--rate", "max", "--localize", str(stored)]
    with open_session([endpoint], patience=PATIENCE) as session:
        listener = Listener(session, team)
        with subprocess.Popen([MAPWEAVE, "agent", *where]) as process:
            listener.until(lambda: listener.finished("b"))
            process.terminate()
            assert process.wait(PATIENCE) == 0
    heard, known = listener.maps["b"], read_map(stored)
    assert not any(len(s.map.segments) or s.map.free_space for s in heard.submaps)
    truth = dict(paths(known))
    found = dict(paths(heard))
    assert len(found) > 0.9 * len(truth)
    off = [np.hypot(*(found[k] - truth[k])[:2]) for k in found if k in truth]
    assert np.max(off) < 0.15


def paths(robot_map: RobotMap) -> Iterator[tuple[int, FloatArray]]:
    for submap in robot_map.submaps:
        path = submap.trajectory
        poses = se2.compose(submap.pose, path.pose)
        yield from zip(path.scan_index.tolist(), poses, strict=True)


def test_a_program_gives_a_map_to_go_on_from_or_one_to_be_found_in(known: RobotMap) -> None:
    with pytest.raises(ArgumentError, match="localize_in: expected none beside continued"):
        mapweave_agent.Agent("a", continued=known, localize_in=known)
