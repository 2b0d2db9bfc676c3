"""The peers get what they need and are judged fairly: mapweave must not look better than it is."""

import argparse
import json
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks import fusion
from benchmarks.logs import Log
from benchmarks.peer_features import feature_peers
from benchmarks.peer_figures import balanced_threshold, f1, joined, safe_threshold
from benchmarks.peer_sweep import correlate
from benchmarks.peer_trials import Trial, judge, try_peer
from benchmarks.peer_types import Guess, Peer, View
from benchmarks.peer_views import FREE, UNKNOWN, WALL, thin, view
from benchmarks.peers import EXTRA, find_peers
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.scan.scan import Scan
from mapweave_deploy.sim.arena import arena
from mapweave_deploy.sim.lidar import LidarParameters, measure
from mapweave_deploy.sim.office import office
from mapweave_deploy.sim.world import World

PEERS = ("AKAZE (map_merge)", "ORB (map_merge)", "KISS-Matcher", "FFT rotation sweep")
LIDAR = LidarParameters()
TURNS = np.radians(np.arange(0.0, 360.0, 2.0))


def _look(world: World, seed: int) -> View:
    """View `world` from its stops, in an order and with headings drawn: the frame is random."""
    rng = np.random.default_rng(seed)
    stops = rng.permutation(world.stops)
    poses = np.column_stack([stops, rng.uniform(-np.pi, np.pi, len(stops))])
    scans = [_scan(k, measure(world, pose, LIDAR, rng)) for k, pose in enumerate(poses)]
    log = Log(world.name, world.name, Path(), Path())
    return view(f"{world.name} {seed}", log, scans, poses)


def _scan(index: int, ranges: FloatArray) -> Scan:
    returned = np.where(ranges < LIDAR.maximum_range, ranges, np.nan)
    return Scan(returned, LIDAR.angles, index, float(index))


@pytest.fixture(scope="module")
def views() -> dict[str, View]:
    """Return two views of one building and one of another."""
    seen = [_look(office(3), 1), _look(office(3), 2), _look(arena(1), 1)]
    return {one.name: one for one in seen}


@pytest.fixture(params=PEERS)
def peer(request: pytest.FixtureRequest) -> Peer:
    """Return each peer, or skip: its package is an extra."""
    for found in find_peers():
        if found.name == request.param:
            return found
    pytest.skip(f"{request.param} is not installed: {EXTRA}")


def test_a_peer_finds_one_view_of_a_building_in_another_and_is_surer_than_of_two_buildings(
    peer: Peer, views: dict[str, View]
) -> None:
    same, other = try_peer(peer, views, [("office 1", "office 2"), ("office 1", "arena 1")])
    assert same.right
    assert same.score is not None
    assert other.score is None or other.score < same.score


# KISS-Matcher is left out: its threads decide what it draws, and it offers no seed.
def test_features_find_nothing_in_a_picture_that_shows_none(views: dict[str, View]) -> None:
    some = next(iter(views.values()))
    blank = replace(some, grid=replace(some.grid, image=np.full_like(some.grid.image, UNKNOWN)))
    for peer in feature_peers(pytest.importorskip("cv2")):
        assert peer.match(peer.prepare(blank), peer.prepare(some)) is None


def test_a_peer_that_draws_answers_the_same_every_time(peer: Peer, views: dict[str, View]) -> None:
    first, second = (peer.prepare(views[name]) for name in ("office 1", "arena 1"))
    one, again = peer.match(first, second), peer.match(first, second)
    if one is None or again is None:
        assert one is again
        return
    np.testing.assert_allclose(one.transform, again.transform)
    assert one.score == again.score


def test_only_a_guess_within_half_a_metre_and_five_degrees_in_one_building_is_right(
    views: dict[str, View],
) -> None:
    first, second = views["office 1"], views["office 2"]
    true = se2.between(first.part.frame, second.part.frame)

    def right(error: list[float], second: View = second) -> bool:
        guess = Guess(true + np.array(error), 1.0)
        return judge("", first, second, guess, 0.0).right

    assert right([0.0, 0.0, 0.0])
    assert right([0.3, 0.39, 0.0])
    assert not right([0.4, 0.4, 0.0])
    assert not right([0.0, 0.0, np.radians(5.1)])
    assert not right([0.0, 0.0, 0.0], views["arena 1"])


def test_a_grid_is_wall_where_beams_end_free_where_they_pass_and_unknown_elsewhere() -> None:
    """Two beams almost along the axes, 2.04 m long, from a pose that is not at the origin."""
    scan = Scan(np.array([2.04, 2.04]), np.array([0.03, np.pi / 2 - 0.03]), 0, 0.0)
    log = Log("", "", Path(), Path())
    grid = view("", log, [scan], np.array([[5.0, -3.0, 0.4]])).grid

    def grey(x: float, y: float) -> int:
        column, row = np.floor((np.array([x, y]) - grid.corner) / grid.cell).astype(int)
        return int(grid.image[row, column])

    assert {grey(2.04, 0.06), grey(0.06, 2.04)} == {WALL}
    assert {grey(x, 0.03 * x) for x in np.arange(0.1, 1.9, 0.1)} == {FREE}
    assert grey(1.0, 1.0) == UNKNOWN
    assert np.sum(grid.image == WALL) == 2


@pytest.mark.parametrize("side", [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)])
def test_the_sweep_finds_a_part_in_the_whole_and_the_whole_in_its_part(
    side: tuple[float, float],
) -> None:
    rng = np.random.default_rng(5)
    ends = rng.uniform(0.0, 20.0, (2, 10, 2))  # of walls from anywhere to anywhere
    along = np.linspace(0.0, 1.0, 100)[:, None, None]
    whole = thin((ends[0] + along * (ends[1] - ends[0])).reshape(-1, 2), 0.2)
    part = whole[(whole - 10.0) @ side > 0.0]
    motion = rng.uniform([-30.0, -30.0, -np.pi], [30.0, 30.0, np.pi])
    moved = se2.transform_points(motion, part)
    _check_found(correlate(whole, moved, TURNS, 0.2), se2.inverse(motion), moved)
    _check_found(correlate(moved, whole, TURNS, 0.2), motion, part)


def _check_found(guess: Guess, motion: FloatArray, points: FloatArray) -> None:
    """Check that `guess` is `motion` within the steps of the sweep and half a cell or so."""
    assert abs(se2.wrap(guess.transform[2] - motion[2])) <= np.radians(2.0)
    apart = se2.transform_points(guess.transform, points) - se2.transform_points(motion, points)
    assert np.median(np.hypot(*apart.T)) < 0.3
    assert guess.score <= 1.0


def _trials(seed: int) -> list[Trial]:
    """Return trials at random; scores are whole numbers, so that right and wrong ones tie."""
    rng = np.random.default_rng(seed)
    return [
        Trial(
            "",
            "",
            "",
            common=float(rng.uniform(0.0, 60.0)),
            crosses=False,
            score=None if rng.random() < 0.1 else float(rng.integers(0, 12) + 4 * right),
            distance=None,
            turn=None,
            right=right,
            seconds=0.0,
        )
        for right in (rng.random(30) < 0.5).tolist()
    ]


@pytest.mark.parametrize("seed", range(20))
def test_the_best_thresholds_are_those_that_brute_force_finds(seed: int) -> None:
    trials = _trials(seed)
    every = [*np.arange(-0.5, 20.0, 0.5), np.inf]
    safe = [t for t in every if all(trial.right for trial in joined(trials, t))]
    assert safe_threshold(trials) in [*safe, *(t.score for t in trials)]
    assert len(joined(trials, safe_threshold(trials))) == max(len(joined(trials, t)) for t in safe)
    assert all(trial.right for trial in joined(trials, safe_threshold(trials)))
    assert f1(trials, balanced_threshold(trials)) == max(f1(trials, t) for t in every)


def test_nothing_is_joined_at_the_safe_threshold_of_a_peer_that_is_only_ever_wrong() -> None:
    trials = [trial for trial in _trials(1) if not trial.right]
    assert joined(trials, safe_threshold(trials)) == []


def test_a_peer_whose_package_is_missing_is_left_out_in_one_line_that_names_the_extra(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for module in ("cv2", "kiss_matcher"):
        monkeypatch.setitem(sys.modules, module, None)  # as import finds it when it is not there
    assert [found.name for found in find_peers()] == ["FFT rotation sweep"]
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 2
    assert all("left out" in line and "[peers]" in line for line in lines)


@pytest.mark.slow
def test_the_fusion_benchmark_puts_the_peers_beside_mapweave_on_the_same_pairs(
    data_dir: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert data_dir.is_dir()
    parser = argparse.ArgumentParser()
    fusion.add_arguments(parser)
    rows = tmp_path / "rows.json"
    asked = ["--logs", "seattle", "--stretches", "3", "--output", str(rows)]
    fusion.run(parser.parse_args(asked))
    told = capsys.readouterr().out
    assert all(name in told for name in ("mapweave, its own decision", "FFT rotation sweep"))
    own = {(row["first"], row["second"]) for row in json.loads(rows.read_text())}
    beside = json.loads((tmp_path / "rows-peers.json").read_text())
    assert {(row["first"], row["second"]) for row in beside} == own
