"""What a robot keeps of its runs on disk, and goes on from."""

from pathlib import Path

import numpy as np
import pytest

from mapweave.errors import FileError
from mapweave.maps import LineMap, RobotMap, Submap, Trajectory
from mapweave_agent.past_runs import (
    StateFolder,
    default_folder,
    first_component,
    numbered_from,
    young_enough,
)
from mapweave_protocol.wire.messages import AlignmentMessage, MapVersion


def a_map(*components: int, boot: str = "x", version: int = 1) -> RobotMap:
    submaps = tuple(
        Submap(number, component, np.zeros(3), LineMap.empty(), Trajectory.empty())
        for number, component in enumerate(components)
    )
    return RobotMap("a", boot, version, submaps)


def test_of_each_run_the_last_map_is_kept_and_the_earliest_run_comes_first(tmp_path: Path) -> None:
    folder = StateFolder(tmp_path / "not" / "yet")
    for robot_map in (a_map(2, boot="a"), a_map(0, boot="z"), a_map(0, 1, boot="z", version=2)):
        folder.keep(robot_map)
    runs = folder.runs("a", now=0.0)
    assert [(run.state.boot, run.state.version) for run in runs] == [("z", 2), ("a", 1)]
    assert [run.map.components for run in runs] == [[0, 1], [2]]


def test_a_file_that_is_no_map_of_the_robot_is_told_and_passed_over(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    folder = StateFolder(tmp_path)
    folder.keep(a_map(0))
    (tmp_path / "cut.map").write_bytes((tmp_path / "x.map").read_bytes()[:-3])
    assert len(folder.runs("a", now=0.0)) == 1
    assert folder.runs("b", now=0.0) == []
    assert "cut.map: passed over" in caplog.text
    assert "x.map: passed over, no whole map of b" in caplog.text


def test_a_run_that_mapped_nothing_is_none(tmp_path: Path) -> None:
    folder = StateFolder(tmp_path)
    folder.keep(a_map())
    assert folder.runs("a", now=0.0) == []


def test_a_run_that_ended_too_long_ago_is_not_taken_up(tmp_path: Path) -> None:
    folder = StateFolder(tmp_path)
    folder.keep(a_map(0))
    written = (tmp_path / "x.map").stat().st_mtime
    assert len(young_enough(folder.runs("a", now=written + 59.0), 60.0)) == 1
    assert young_enough(folder.runs("a", now=written + 61.0), 60.0) == []


def test_a_run_numbers_its_components_above_those_of_all_before_it() -> None:
    assert first_component([]) == 0
    assert first_component([a_map(), a_map(0, 4), a_map(2)]) == 5
    assert numbered_from(a_map(0, 1), 5).components == [5, 6]
    assert numbered_from(a_map(0, 1), 0).components == [0, 1]


def test_the_folder_is_where_the_desktop_says_state_belongs() -> None:
    assert default_folder("t", "a", {"XDG_STATE_HOME": "/s"}) == Path("/s/mapweave/t/a")
    assert default_folder("t", "a", {}) == Path.home() / ".local/state/mapweave/t/a"


def test_a_folder_that_cannot_be_made_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(FileError, match="file/state"):
        StateFolder(tmp_path / "file" / "state")


def test_what_a_run_found_is_kept_beside_its_map(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    folder = StateFolder(tmp_path)
    folder.keep(a_map(0))
    ends = [MapVersion(robot=robot, boot="x", version=1) for robot in ("a", "b")]
    message = AlignmentMessage.pack("a", ends[0], ends[1], [])
    folder.keep_found("x", [message])
    [run] = folder.runs("a", now=0.0)
    assert run.found == (message,)
    (tmp_path / "x.found").write_bytes(b"cut")
    [run] = folder.runs("a", now=0.0)
    assert run.found == ()
    assert "x.found: passed over" in caplog.text
