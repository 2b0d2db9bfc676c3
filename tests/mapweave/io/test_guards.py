"""What is found out before the work, and what is never lost."""

from itertools import islice
from pathlib import Path

import pytest

from mapweave.atomic import check_outputs
from mapweave.errors import FileError
from mapweave.io.readers import read_scans
from mapweave.io.readers.beams import DamagedLineError, beam_angles

WHOLE = "FLASER 3 1.0 2.0 3.0 0 0 0 0 0 0 1.0 host 1.0\n"


@pytest.mark.parametrize(
    ("start", "resolution"),
    [(1e18, 0.01), (0.0, 1e-300), (0.0, 1e-17), (0.0, float("nan")), (0.0, float("inf"))],
)
def test_beams_that_cannot_be_told_apart_are_damage(start: float, resolution: float) -> None:
    with pytest.raises(DamagedLineError):
        beam_angles(start, resolution, 180)


def test_damage_is_told_even_if_nobody_wants_the_rest(tmp_path: Path) -> None:
    log = tmp_path / "x.log"
    log.write_text(WHOLE + "FLASER 3 1.0\n" + WHOLE * 3)
    said: list[str] = []
    scans = read_scans(log, on_warning=said.append)
    assert len(list(islice(scans, 2))) == 2
    del scans  # as when a range of scans was all that was asked for
    assert len(said) == 1
    assert "line 2" in said[0]


def test_a_result_never_overwrites_an_input_or_another_result(tmp_path: Path) -> None:
    log, out = tmp_path / "x.log", tmp_path / "out"
    log.write_text(WHOLE)
    check_outputs([out, None], [log])
    with pytest.raises(FileError, match="is read"):
        check_outputs([log], [log])
    with pytest.raises(FileError, match="two results"):
        check_outputs([out, out], [log])
    with pytest.raises(FileError, match=f"there is no folder {tmp_path}/none$"):
        check_outputs([tmp_path / "none" / "out"], [log])
    with pytest.raises(FileError, match=f"{log} is no folder"):
        check_outputs([log / "out"], [])


def test_that_a_folder_may_not_be_written_is_said_with_its_whole_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("os.access", lambda *_: False)  # as for any user but root
    with pytest.raises(FileError, match=f"the folder {tmp_path} may not be written by this user"):
        check_outputs([Path("out")], [])
