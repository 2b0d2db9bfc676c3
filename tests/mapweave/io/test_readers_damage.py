"""What is whole in a damaged log is used; what is not is told once, in a line."""

import gzip
import io
import os
import subprocess
import sys
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mapweave.errors import FileError
from mapweave.io.readers import count_scans, read_reference_poses, read_scans
from mapweave.io.readers.lines import MAX_LINE
from mapweave.scan.scan import Scan

FLASER = b"FLASER 5 1.5 2.5 3.5 4.5 5.5 1 2 0.5 3 4 0.25 17.5 host 0.1\n"
BLIND = b"FLASER 5 81.91 81.91 0 nan 50.0 1 2 0.5 3 4 0.25 17.5 host 0.1\n"
ROBOTLASER = (
    b"ROBOTLASER1 0 -0.5 1.0 0.25 30.0 0.01 0 5 1.5 2.5 3.5 4.5 5.5 1 9"
    b" 0.96 2 0 1 2 0 0 0 0 0 0 17.5 host 0.1\n"
)
LOG = b"".join(
    b"FLASER 5 %.3f %.3f %.3f %.3f %.3f 1 2 0.5 3 4 0.25 %d host 0.1\n" % (*readings, second)
    for second, readings in enumerate(np.random.default_rng(1).uniform(1, 9, (40, 5)).tolist())
)

DAMAGED = {
    "a beam is missing": FLASER.replace(b" 3.5", b""),
    "a word too many": FLASER.replace(b" 3.5", b" 3.5 3.5"),
    "its end is missing": FLASER[:30] + b"\n",
    "only its name": b"FLASER\n",
    "part of its name": b"FLAS\n",
    "a reading is no number": FLASER.replace(b"3.5", b"3.x5"),
    "a pose is no number": FLASER.replace(b"0.25", b"none"),
    "its stamp is no number": FLASER.replace(b"17.5", b"now"),
    "its count is no number": FLASER.replace(b" 5 ", b" five "),
    "its count is negative": FLASER.replace(b" 5 ", b" -5 "),
    "its count is huge": FLASER.replace(b" 5 ", b" " + b"9" * 6000 + b" "),
    "no beam": b"FLASER 0 1 2 0.5 3 4 0.25 17.5 host 0.1\n",
    "one beam": b"FLASER 1 9 1 2 0.5 3 4 0.25 17.5 host 0.1\n",
    "garbage within": FLASER.replace(b"2.5 3.5", b"2\xff\x00\x80 \xfe"),
    "garbage for a name": b"\x00\x01\xff" + FLASER[3:],
    "its start is missing": FLASER[12:],
    "too long": FLASER[:-1] + b" 1" * MAX_LINE + b"\n",
    "no remissions": ROBOTLASER[:75] + b"\n",
    "too few remissions": ROBOTLASER.replace(b" 1 9", b" 2 9"),
    "no resolution": ROBOTLASER.replace(b" 1.0 0.25 ", b" 0 0 "),
    "a resolution that is not finite": ROBOTLASER.replace(b" 0.25 ", b" nan "),
    "more than a turn": ROBOTLASER.replace(b" 0.25 ", b" 3 "),
    "a start that is not finite": ROBOTLASER.replace(b" -0.5 ", b" inf "),
}

UNUSABLE = {
    "empty": (b"", "is empty"),
    "empty gzip": (gzip.compress(b""), "is empty"),
    "prose": (b"It was a dark night.\nDon't ask.\n", "holds no laser scan"),
    "another log": (b"ODOM 1 2 3 0 0 0 1 host 1\n", "holds no laser scan"),
    "binary": (bytes(range(256)) * 40, "holds no laser scan"),
    "blind": (BLIND * 3, "in none of its 3 scans did a beam come back"),
    "blind and damaged": (BLIND * 3 + FLASER[:20], "in none of its 3 scans did a beam come back"),
    "damaged": (FLASER[:30] + b"\n" + FLASER[:40], "2 damaged lines, the first line 1: FLASER has"),
    "cut gzip": (gzip.compress(FLASER)[:15], "the gzip stream is cut off"),
    "cut zip": (b"PK\x03\x04\x00", "the zip archive is cut off"),
}


def write(tmp_path: Path, content: bytes) -> Path:
    path = tmp_path / "log"
    path.write_bytes(content)
    return path


def read(path: Path) -> tuple[list[Scan], list[str]]:
    warnings: list[str] = []
    return list(read_scans(path, on_warning=warnings.append)), warnings


def assert_prefix(scans: list[Scan], whole: list[Scan]) -> None:
    for scan, expected in zip(scans, whole, strict=False):
        assert (scan.index, scan.stamp) == (expected.index, expected.stamp)
        np.testing.assert_array_equal(scan.ranges, expected.ranges)


def zipped(text: bytes, method: int = zipfile.ZIP_DEFLATED) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", method) as archive:
        archive.writestr("the.log", text)
    return buffer.getvalue()


@pytest.mark.parametrize("damage", DAMAGED)
def test_a_damaged_line_takes_no_index_and_is_told_once(damage: str, tmp_path: Path) -> None:
    # The whole lines are of the damaged one's kind, so that only the damage tells them apart.
    whole = ROBOTLASER if DAMAGED[damage].startswith(b"ROBOT") else FLASER
    path = write(tmp_path, whole + DAMAGED[damage] + whole)
    scans, warnings = read(path)
    assert [scan.index for scan in scans] == [0, 1]
    (warning,) = warnings
    assert warning.startswith(f"{path}: dropped 1 damaged line, the first line 2: ")
    assert warning.isprintable()


def test_many_damaged_lines_make_one_warning_that_names_the_first(tmp_path: Path) -> None:
    lines = [FLASER, *DAMAGED.values(), FLASER, FLASER[:25]]
    scans, (warning,) = read(write(tmp_path, b"".join(lines)))
    assert len(scans) == 2
    assert f"dropped {len(DAMAGED) + 1} damaged lines, the first line 2: FLASER has" in warning


def test_a_blind_scan_among_others_keeps_its_index(tmp_path: Path) -> None:
    scans, warnings = read(write(tmp_path, FLASER + BLIND + FLASER))
    assert [(scan.index, int(scan.hits.sum())) for scan in scans] == [(0, 5), (1, 0), (2, 5)]
    assert not warnings


def test_lines_of_other_kinds_are_no_damage(tmp_path: Path) -> None:
    others = b"# x\n#SEQUENTIAL\n\n  \nODOM 1 2\nVERTEX_SE3:QUAT 1\r\nRLASER 1 2\nNEFF 3\n// x\n"
    assert not read(write(tmp_path, others + FLASER))[1]


@pytest.mark.parametrize("ending", [b"", b"\r\n"])
def test_the_line_break_makes_no_difference(ending: bytes, tmp_path: Path) -> None:
    scans, warnings = read(write(tmp_path, FLASER[:-1] + ending))
    assert (len(scans), warnings) == (1, [])


@pytest.mark.parametrize("kept", range(1, len(FLASER) - 5))
def test_a_log_cut_off_within_a_line_gives_the_lines_before(kept: int, tmp_path: Path) -> None:
    scans, warnings = read(write(tmp_path, FLASER * 2 + FLASER[:kept]))
    assert len(scans) == 2
    assert len(warnings) == 1
    assert "dropped 1 damaged line, the first line 3: " in warnings[0]


@pytest.mark.parametrize("pack", [gzip.compress, zipped], ids=["gzip", "zip"])
def test_an_archive_cut_off_anywhere_gives_whole_scans(
    pack: Callable[[bytes], bytes], tmp_path: Path
) -> None:
    archive = pack(LOG)
    (whole, _), best = read(write(tmp_path, archive)), 0
    for kept in range(100, len(archive) - 120, 13):
        try:
            scans, warnings = read(write(tmp_path, archive[:kept]))
        except FileError:
            assert best == 0  # Too little was left for even one scan.
            continue
        assert_prefix(scans, whole)
        assert len(warnings) == 1
        assert "is cut off" in warnings[0]
        assert len(scans) >= best
        best = len(scans)
    assert best > len(whole) / 2


def test_a_real_recording_cut_off_gives_all_scans_before_the_cut(
    data_dir: Path, tmp_path: Path
) -> None:
    archive = (data_dir / "seattle.log.gz").read_bytes()
    whole, _ = read(data_dir / "seattle.log.gz")
    scans, warnings = read(write(tmp_path, archive[: len(archive) // 2]))
    assert 80 < len(scans) < 160
    assert_prefix(scans, whole)
    assert len(warnings) == 1


@pytest.mark.parametrize("kind", UNUSABLE)
def test_a_log_without_a_usable_scan_is_refused_in_one_line(kind: str, tmp_path: Path) -> None:
    content, problem = UNUSABLE[kind]
    path = write(tmp_path, content)
    with pytest.raises(FileError) as caught:
        read(path)
    message = str(caught.value)
    assert message.startswith(f"{path}: ")
    assert problem in message
    assert "expected a CARMEN, TORO or g2o log" in message
    assert message.isprintable()


def test_an_archive_of_nothing_is_refused(tmp_path: Path) -> None:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        archive.writestr("folder/", b"")
    with pytest.raises(FileError, match="empty zip archive"):
        read(write(tmp_path, buffer.getvalue()))


def test_an_archive_of_another_compression_is_refused(tmp_path: Path) -> None:
    with pytest.raises(FileError, match="encrypted or not deflated"):
        read(write(tmp_path, zipped(FLASER, zipfile.ZIP_BZIP2)))


@pytest.mark.parametrize("reader", [read, count_scans, read_reference_poses])
def test_a_missing_file_and_a_folder_are_refused(
    reader: Callable[[Path], object], tmp_path: Path
) -> None:
    with pytest.raises(FileError, match="no such file; expected"):
        reader(tmp_path / "missing.log")
    with pytest.raises(FileError, match="is a folder; expected"):
        reader(tmp_path)


def test_a_missing_file_is_refused_before_the_first_scan_is_asked_for(tmp_path: Path) -> None:
    with pytest.raises(FileError):
        read_scans(tmp_path / "missing.log", on_warning=pytest.fail)


@pytest.mark.skipif(os.geteuid() == 0, reason="root may read everything")
def test_a_file_that_may_not_be_read_is_refused(tmp_path: Path) -> None:
    path = write(tmp_path, FLASER)
    path.chmod(0)
    with pytest.raises(FileError, match="cannot be read"):
        read(path)


@pytest.mark.skipif(not Path("/proc/self/mem").exists(), reason="no file that cannot be read")
def test_a_file_that_breaks_off_under_the_reader_is_refused() -> None:
    with pytest.raises(FileError, match=r"cannot be read \(Input/output error\)"):
        read(Path("/proc/self/mem"))


def test_a_log_can_be_piped_in(tmp_path: Path) -> None:
    code = (
        "from mapweave.io.readers import read_scans\n"
        "print(len(list(read_scans('/dev/stdin', on_warning=print))))"
    )
    packed = gzip.compress(LOG)
    done = subprocess.run(
        [sys.executable, "-c", code], input=packed, capture_output=True, check=True, cwd=tmp_path
    )
    assert done.stdout.split() == [b"40"]


def test_a_hostile_archive_takes_little_memory(tmp_path: Path) -> None:
    """A gigabyte in one line, packed into a megabyte, is passed over in bounded memory."""
    code = (
        "import resource, sys\n"
        "from mapweave.io.readers import read_scans\n"
        "resource.setrlimit(resource.RLIMIT_DATA, (300 << 20, 300 << 20))\n"
        "print(len(list(read_scans(sys.argv[1], on_warning=print))))"
    )
    path = tmp_path / "bomb.gz"
    with gzip.open(path, "wb", compresslevel=1) as bomb:
        bomb.write(FLASER)
        for _ in range(512):
            bomb.write(b"7 " * (1 << 19))
        bomb.write(b"\n" + FLASER)
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
    done = subprocess.run(
        [sys.executable, "-c", code, str(path)], capture_output=True, check=True, env=environment
    )
    assert b"dropped 1 damaged line, the first line 2: longer than" in done.stdout
    assert done.stdout.endswith(b"\n2\n")


@settings(max_examples=150, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    places=st.lists(st.tuples(st.integers(0, len(LOG) - 1), st.binary(max_size=4)), max_size=8),
    packed=st.booleans(),
)
def test_garbage_anywhere_never_raises_anything_but_a_file_error(
    places: list[tuple[int, bytes]], packed: bool, tmp_path: Path
) -> None:
    log = bytearray(gzip.compress(LOG) if packed else LOG)
    for place, garbage in places:
        log[place % len(log) : place % len(log) + len(garbage)] = garbage
    path = write(tmp_path, bytes(log))
    try:
        scans, warnings = read(path)
    except FileError as error:
        assert str(error).isprintable()
        return
    assert [scan.index for scan in scans] == list(range(len(scans)))
    assert len(warnings) <= 1
    assert all(scan.angles.shape == scan.ranges.shape for scan in scans)
