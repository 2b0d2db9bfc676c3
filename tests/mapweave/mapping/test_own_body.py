"""A robot that sees its own body: what moves with the sensor is neither wall nor place."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mapweave.geometry.arrays import FloatArray
from mapweave.io.readers import read_scans
from mapweave.mapping.mapper import AGAIN, Mapper
from mapweave.mapping.tracking.observation import Observation, ObservationParameters, observe
from mapweave.scan.scan import Scan
from mapweave_deploy.sim.own_body import OwnBodyParameters, body_ranges
from tests.mapweave.buildings import AROUND, BUILDING, corridor, tour, walls_of
from tests.mapweave.mapping.drives import errors, scans_at, straight, tracks

CASES = Path(__file__).parents[2] / "cases"
TOUR = np.array(list(tour([(2, 1), (13, 1), (13, -2)], 0.3)))


def with_body(scans: list[Scan], degrees: float, away: float, seed: int = 0) -> list[Scan]:
    """Return `scans` that see the robot `degrees` wide behind the sensor, `away` [m] or more."""
    rng = np.random.default_rng(seed)
    beside = np.pi - np.abs(AROUND)  # from straight behind
    hidden = beside < np.radians(degrees) / 2
    at = away / np.cos(np.minimum(beside, 1.0))
    return [
        replace(s, ranges=np.where(hidden, at + rng.normal(0, 0.005, len(at)), s.ranges))
        for s in scans
    ]


@pytest.mark.parametrize(
    ("degrees", "away"), [(0, 0.3), (20, 0.4), (60, 0.3), (90, 0.15), (120, 0.25), (150, 0.2)]
)
def test_a_robot_that_sees_itself_is_followed_and_told_so_once(degrees: float, away: float) -> None:
    said: list[str] = []
    mapper = Mapper("a", on_warning=said.append)
    for scan in with_body(scans_at(walls_of(BUILDING), TOUR, 0.5), degrees, away):
        mapper.add(scan)
    assert len(said) == (degrees > 0)
    robot_map = mapper.finish()
    assert robot_map.components == [0]
    off = errors(robot_map, TOUR)
    assert len(off) >= len(TOUR) - 2 and np.hypot(off[:, 0], off[:, 1]).max() < 0.25


@pytest.mark.parametrize("step", [0.04, 0.08])
def test_a_robot_that_sees_itself_at_a_high_rate_is_found_out_too(step: float) -> None:
    true = np.array(list(tour([(2, 1), (8, 1)], step)))
    said: list[str] = []
    mapper = Mapper("a", on_warning=said.append)
    for scan in with_body(scans_at(walls_of(BUILDING), true, 0.1), 120, 0.25):
        mapper.add(scan)
    robot_map = mapper.finish()
    assert len(said) == 1 and robot_map.components == [0]
    off = errors(robot_map, true)
    assert np.hypot(off[:, 0], off[:, 1]).max() < 0.25


def test_the_body_is_in_no_map() -> None:
    mapper = Mapper("a")
    for scan in with_body(scans_at(walls_of(BUILDING), TOUR, 0.5), 120, 0.25):
        mapper.add(scan)
    [lines] = [mapper.finish().lines(0)]
    middles = (lines.segments[:, :2] + lines.segments[:, 2:]) / 2 + TOUR[0, :2]
    # The way keeps 0.9 m from every wall: nothing is nearer to it but the robot.
    away = np.hypot(*(middles[:, None] - TOUR[None, :, :2]).transpose(2, 0, 1)).min(axis=1)
    assert away.min() > 0.7


def test_scans_that_are_judged_again_hold_up_no_scan(monkeypatch: pytest.MonkeyPatch) -> None:
    """A few are taken with each scan that comes, until the last is placed as it comes again."""
    taken: list[int] = []

    def counted(scan: Scan, parameters: ObservationParameters) -> Observation:
        taken[-1] += 1
        return observe(scan, parameters)

    monkeypatch.setattr("mapweave.mapping.mapper.observe", counted)
    true = np.array(list(tour([(2, 1), (13, 1), (13, -2), (13, 1), (28, 1)], 0.15)))
    mapper, placed = Mapper("a"), []
    for scan in with_body(scans_at(walls_of(BUILDING), true, 0.25), 120, 0.25):
        taken.append(0)
        placed.append(mapper.add(scan).placed)
    assert 1 < max(taken) <= AGAIN
    assert taken[-1] == 1 and placed[-1]
    assert len(errors(mapper.finish(), true)) >= len(true) - 2


def narrow(aside: float) -> tuple[FloatArray, FloatArray]:
    """Return walls of a corridor with niches, and a drive `aside` [m] from one of them."""
    niches = [(3.0, 4.0, 0.4), (9.0, 10.5, 0.8), (16.0, 17.0, 0.5)]
    walls = walls_of(corridor(24.0, [], niches, width=1.6))
    return walls, straight(np.array([1.0, aside]), np.array([20.0, aside]), 0.3)


@pytest.mark.parametrize("aside", [0.3, 0.5, 0.8])
def test_a_wall_beside_the_way_is_no_body(aside: float) -> None:
    walls, true = narrow(aside)
    said: list[str] = []
    mapper = Mapper("a", on_warning=said.append)
    for scan in scans_at(walls, true, 0.5):
        mapper.add(scan)
    assert said == []


@pytest.mark.parametrize("posts", [2, 4])
def test_posts_about_the_sensor_are_the_robot_too(posts: int) -> None:
    body = OwnBodyParameters(posts=posts)
    rng = np.random.default_rng(posts)
    own = body_ranges(AROUND, body, rng)
    said: list[str] = []
    mapper = Mapper("a", on_warning=said.append)
    for s in scans_at(walls_of(BUILDING), TOUR, 0.5):
        seen = np.fmin(s.ranges, own + rng.normal(0, 0.004, len(own)))
        mapper.add(replace(s, ranges=np.where(np.isfinite(seen), seen, np.nan)))
    robot_map = mapper.finish()
    assert len(said) == 1 and robot_map.components == [0]
    assert np.hypot(*errors(robot_map, TOUR)[:, :2].T).max() < 0.25


def test_a_body_that_is_away_now_and_then_is_found_out_once_it_is_back() -> None:
    true = np.array(list(tour([(2, 1), (13, 1), (13, -2), (13, 1), (28, 1)], 0.15)))
    scans = scans_at(walls_of(BUILDING), true, 0.25)
    with_it = with_body(scans, 60, 0.3)
    said: list[str] = []
    mapper = Mapper("a", on_warning=said.append)
    for k, (own, clear) in enumerate(zip(with_it, scans, strict=True)):
        mapper.add(clear if 60 <= k < 90 else own)
    robot_map = mapper.finish()
    assert len(said) == 1 and robot_map.components == [0]
    assert np.hypot(*errors(robot_map, true)[:, :2].T).max() < 0.25


def test_the_case_of_a_body_of_120_degrees_is_mapped_as_the_drive_without_it() -> None:
    placed = {}
    for name in ("body", "clean"):
        mapper = Mapper("a")
        for scan in read_scans(CASES / "own_body" / f"{name}.log"):
            mapper.add(scan)
        robot_map = mapper.finish()
        assert robot_map.components == [0]
        [(index, placed[name])] = tracks(robot_map)
        assert index == list(range(12))
    np.testing.assert_allclose(placed["body"], placed["clean"], atol=0.05)


def test_codes_of_what_went_wrong_are_no_body_and_part_no_wall(rng: np.random.Generator) -> None:
    clean = scans_at(walls_of(BUILDING), TOUR, 0.1)
    lost = [rng.random(len(scan.ranges)) < 0.1 for scan in clean]  # strewn over the walls
    for gone in lost:
        gone[60:80] = True  # and side by side, as a body is
    said: list[str] = []
    mapped = []
    for written in (np.nan, 0.007):
        mapper = Mapper("a", on_warning=said.append)
        for scan, gone in zip(clean, lost, strict=True):
            mapper.add(replace(scan, ranges=np.where(gone, written, scan.ranges)))
        mapped.append(mapper.finish())
    assert not said
    without, coded = ([poses for _, poses in tracks(each)] for each in mapped)
    np.testing.assert_array_equal(np.vstack(coded), np.vstack(without))
