"""An output file is written whole or not at all."""

from pathlib import Path

import numpy as np
import pytest

from mapweave.atomic import replace_file
from mapweave.errors import FileError
from mapweave.io.map_files import write_map
from mapweave.maps import LineMap, RobotMap, Submap, Trajectory


class InterruptedWriteError(Exception):
    """What goes wrong in the middle of writing."""


def test_the_file_appears_only_when_the_block_has_ended(tmp_path: Path) -> None:
    path = tmp_path / "picture.png"
    with replace_file(path) as temporary:
        temporary.write_bytes(b"\x89PNG")
        assert not path.exists()
        # Same folder, so that it can take its name at once; same suffix, for those who go by it.
        assert (temporary.parent, temporary.suffix) == (tmp_path, ".png")
    assert path.read_bytes() == b"\x89PNG"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("error", [InterruptedWriteError, KeyboardInterrupt])
def test_an_existing_file_survives_a_failure_and_nothing_else_is_left(
    error: type[BaseException], tmp_path: Path
) -> None:
    path = tmp_path / "map.json"
    path.write_text("old")
    with pytest.raises(error), replace_file(path) as temporary:
        temporary.write_text("half")
        raise error
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_a_failure_of_the_disk_is_a_file_error(tmp_path: Path) -> None:
    path = tmp_path / "map.json"
    with pytest.raises(FileError, match=r"map\.json: cannot be written"), replace_file(path):
        Path("/dev/full").write_text("more than fits")
    assert list(tmp_path.iterdir()) == []


def test_a_map_with_a_number_that_is_not_finite_is_not_written(tmp_path: Path) -> None:
    lines = LineMap(np.full((1, 4), np.nan), np.zeros(1, dtype=int), np.ones(1, dtype=int))
    submap = Submap(0, 0, np.zeros(3), lines, Trajectory.empty())
    with pytest.raises(ValueError, match="JSON"):
        write_map(tmp_path / "map.json", RobotMap("r", "b", 1, (submap,)))
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("place", "problem"),
    [("missing/map.json", "No such file"), ("file/map.json", "Not a directory"),
     ("x" * 300, "File name too long"), ("folder", "is not a regular file")],
)  # fmt: skip
def test_where_no_file_can_be_written_is_told_in_one_line(
    place: str, problem: str, tmp_path: Path
) -> None:
    (tmp_path / "file").touch()
    (tmp_path / "folder").mkdir()
    before = sorted(tmp_path.iterdir())
    with pytest.raises(FileError, match=problem) as caught, replace_file(tmp_path / place):
        pytest.fail("nothing can be written there")
    assert str(caught.value).startswith(f"{tmp_path / place}: ")
    assert str(caught.value).isprintable()
    assert sorted(tmp_path.iterdir()) == before


def test_a_device_is_never_replaced() -> None:
    with pytest.raises(FileError, match="not a regular file"), replace_file("/dev/null"):
        pytest.fail("a device was to be replaced")
    assert Path("/dev/null").is_char_device()


def test_a_symbolic_link_stays_one(tmp_path: Path) -> None:
    (tmp_path / "folder").mkdir()
    link, target = tmp_path / "link.json", tmp_path / "folder" / "target.json"
    link.symlink_to(target)
    with replace_file(link) as temporary:
        temporary.write_text("new")
    assert link.is_symlink()
    assert target.read_text() == "new"


def test_others_may_read_the_file_as_they_may_any_other(tmp_path: Path) -> None:
    (tmp_path / "any.json").touch()
    with replace_file(tmp_path / "map.json"):
        pass
    modes = {path.stat().st_mode for path in tmp_path.iterdir()}
    assert len(modes) == 1
