"""Whatever a file holds, reading it gives something or one line that names the file."""

import gzip
import warnings
from collections.abc import Callable
from itertools import islice
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import mapweave
from mapweave.config import Config
from mapweave.errors import MapweaveError
from mapweave.io.readers.options import ReadOptions
from mapweave.io.readers.reference_poses import read_reference_poses
from mapweave.io.sources import open_source

CASES = Path(__file__).parents[2] / "cases"
FLASER = (
    b"FLASER 5 1.0 2.0 3.0 2.0 1.0 0.1 0.2 0.3 0.1 0.2 0.3 10.0 robot 10.0\n"
    b"ODOM 0.1 0.2 0.3 0 0 0 10.0 robot 10.0\n"
    b"PARAM robot_frontlaser_max 20.0 10.0 robot 10.0\n"
)
LINES = (
    b'{"format": "mapweave/scans/1"}\n'
    b'{"ranges": [1, 2, null, 3], "angle_min": -1.5, "angle_increment": 0.5, "stamp": 1.5}\n'
)
MAP = (
    b'{"format": "mapweave/map/1", "robot": "a", "boot": "b", "version": 1, "submaps": [{"id": 0,'
    b' "component": 0, "pose": [0, 0, 0], "polylines": [[[0, 0, 1, 0]]], "support": [[3]],'
    b' "free_space": [[[0, 0], [1, 0], [1, 1]]], "trajectory": [[0, 1.5, 0, 0, 0]]}]}'
)
TOML = b"[sensor]\nrange_sigma = 0.03\nmax_range = 20.0\n[robot]\nmax_speed = 1.5\n[mapping]\n"
SEEDS = (FLASER, LINES, MAP, TOML, gzip.compress(FLASER))
DEEP = (
    b"[" * 100_000,
    b'{"a":' * 100_000,
    b'{"format": "mapweave/map/1", "submaps": ' + b"[" * 50_000,
)
MOST_SCANS = 50
Reader = Callable[[Path], object]


def _scans(path: Path) -> object:
    options = ReadOptions(odometry=True, angular_step=None, topic=None, on_warning=lambda _: None)
    return list(islice(open_source(str(path), options).scans(), MOST_SCANS))


READERS: dict[str, Reader] = {
    "map": mapweave.load,
    "scans": _scans,
    "reference poses": read_reference_poses,
    "configuration": lambda path: Config.load(path, {}),
}


@st.composite
def damaged(draw: st.DrawFn) -> bytes:
    """Draw a file that was right once: cut, doubled, overwritten, or anything at all."""
    content = bytearray(draw(st.sampled_from(SEEDS)))
    for _ in range(draw(st.integers(0, 4))):
        at = draw(st.integers(0, len(content)))
        match draw(st.sampled_from(["cut", "insert", "replace", "double"])):
            case "cut":
                del content[at : at + draw(st.integers(1, 40))]
            case "insert":
                content[at:at] = draw(st.binary(max_size=40))
            case "replace":
                words = (b"nan", b"1e999", b"-1", b"99999999999999999999", b"null", b"{}", b"\\x00")
                word = draw(st.sampled_from(words))
                content[at : at + len(word)] = word
            case "double":
                content[at:at] = content[at : at + 60]
    return bytes(content)


def _reads_or_says_why(reader: Reader, path: Path) -> None:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            reader(path)
    except MapweaveError as error:
        told = str(error)
        assert path.name in told
        assert "\n" not in told
        assert len(told) < 2000


@pytest.mark.parametrize("reader", READERS)
@given(content=st.one_of(damaged(), st.binary(max_size=300)))
@settings(
    deadline=None, max_examples=150, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
def test_any_file_is_read_or_refused_in_one_line(
    reader: str, content: bytes, tmp_path: Path
) -> None:
    path = tmp_path / "some.file"
    path.write_bytes(content)
    _reads_or_says_why(READERS[reader], path)


@pytest.mark.parametrize("reader", READERS)
@pytest.mark.parametrize("content", DEEP, ids=["arrays", "objects", "a map"])
def test_depth_without_end_is_refused_in_one_line(
    reader: str, content: bytes, tmp_path: Path
) -> None:
    path = tmp_path / "deep.file"
    path.write_bytes(content)
    _reads_or_says_why(READERS[reader], path)


@pytest.mark.parametrize("reader", READERS)
def test_what_unfolds_to_much_more_is_read_as_far_as_needed_or_refused(
    reader: str, tmp_path: Path
) -> None:
    path = tmp_path / "bomb.gz"
    path.write_bytes(gzip.compress(bytes(64 * 2**20)))
    _reads_or_says_why(READERS[reader], path)
