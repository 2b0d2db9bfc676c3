"""Times are counted where they pass, and figures are told apart from those that fall short."""

import argparse
import json
import sys
from pathlib import Path

import numpy as np
import pytest

from benchmarks.speed import command
from benchmarks.speed.comparisons import buildings, many_walls, wall
from benchmarks.speed.rows import Figure, Report
from benchmarks.speed.scans import Gicp, TimedMapper, find_gicp, map_timed, simulated_scans
from mapweave.mapping.mapper import Mapper


def test_a_time_that_grows_with_the_square_has_an_exponent_of_two() -> None:
    assert Report().grow("x", "n", [10, 20, 50], [1.0, 4.0, 25.0]).exponent == pytest.approx(2.0)


def test_a_figure_at_its_bound_is_reached_and_beyond_it_falls_short() -> None:
    assert [Figure("x", value, 3.0).is_met for value in (2.9, 3.0, 3.1)] == [True, True, False]
    reached = [Figure("x", value, 3.0, at_least=True).is_met for value in (2.9, 3.0, 3.1)]
    assert reached == [False, True, True]


def test_a_timed_mapper_makes_the_map_of_a_plain_one_and_counts_every_stage() -> None:
    scans = simulated_scans(180, 40)
    timed, plain = TimedMapper(), Mapper()
    for scan in scans:
        assert timed.add(scan).placed == plain.add(scan).placed
    ours, theirs = timed.finish(), plain.finish()
    assert np.array_equal(ours.lines(0).segments, theirs.lines(0).segments)
    assert len(timed.scans) == len(scans) + 1
    assert all(each["track"] > 0 and each["merge"] > 0 for each in timed.scans[1:-1])
    assert timed.scans[-1]["submap"] > 0


def test_what_followed_leaves_out_the_first_scans_and_the_end() -> None:
    done = map_timed(simulated_scans(180, 40))
    assert len(done.stages) == 41
    assert len(done.followed) == 30
    assert done.everything > done.followed.mean()


def test_a_missing_package_is_said_and_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "small_gicp", None)
    report = Report()
    assert find_gicp(report) is None
    assert "small_gicp left out" in report.tell()


def test_small_gicp_is_timed_once_a_scan() -> None:
    peer = Gicp(pytest.importorskip("small_gicp"))
    for scan in simulated_scans(180, 5):
        peer.add(scan)
    assert len(peer.times) == 5
    assert min(peer.times) > 0


def test_simulated_lines_are_as_many_as_asked_for() -> None:
    assert [len(made) for made in (wall(50, 10.0), many_walls(50))] == [50, 50]
    assert len(buildings(500).segments) == 500


@pytest.mark.parametrize(("arguments", "status"), [([], 1), (["--report-only"], 0)])
def test_the_exit_status_says_whether_all_figures_are_reached(
    arguments: list[str], status: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def short(report: Report, log: str, most: int) -> None:
        report.reach(f"{log}, {most} scans", 2.0, 1.0)

    monkeypatch.setattr(command, "measure_log", short)
    parser = argparse.ArgumentParser()
    command.add_arguments(parser)
    file = tmp_path / "speed.json"
    options = parser.parse_args(["--only", "scans", "--output", str(file), *arguments])
    ended = 0
    try:
        command.run(options)
    except SystemExit as end:
        ended = int(str(end.code))
    assert ended == status
    assert json.loads(file.read_text())["figures"][0]["reached"] == 2.0
