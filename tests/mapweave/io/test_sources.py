"""A source is a file, standard input, or what a package brings under a scheme of its own."""

import os
from collections.abc import Iterator
from importlib.metadata import EntryPoint, EntryPoints
from pathlib import Path

import pytest

from mapweave.errors import FileError, UnknownSourceError
from mapweave.io import sources
from mapweave.io.readers.options import ReadOptions
from mapweave.io.sources import Recording, ScanSource, StandardInput, open_source
from mapweave.scan.scan import Scan

FLASER = b"FLASER 5 1.5 2.5 3.5 4.5 5.5 1 2 0.5 3 4 0.25 17.5 host 0.1\n"


class Lidar:
    """What a package of somebody else brings."""

    live = True

    def __init__(self, name: str, options: ReadOptions) -> None:
        self.name, self.options = name, options

    def count(self) -> None:
        """Nobody knows."""

    def scans(self) -> Iterator[Scan]:
        """Yield one scan."""
        yield Scan([1.0, 2.0], [0.0, 0.1], 0)


@pytest.fixture(autouse=True)
def installed(monkeypatch: pytest.MonkeyPatch) -> None:
    """Have a package installed that brings the scheme ``lidar``."""
    points = EntryPoints([EntryPoint("lidar", f"{__name__}:Lidar", sources.SOURCE_GROUP)])
    monkeypatch.setattr(sources, "entry_points", lambda group: points.select(group=group))
    monkeypatch.setattr(EntryPoint, "load", lambda _: Lidar)


def test_a_package_brings_a_source_under_its_scheme() -> None:
    options = ReadOptions(topic="/scan")
    source: ScanSource = open_source("lidar:/dev/ttyUSB0", options)
    assert isinstance(source, Lidar)
    assert (source.name, source.options) == ("lidar:/dev/ttyUSB0", options)
    assert [scan.index for scan in source.scans()] == [0]


def test_a_scheme_that_nobody_brings_names_those_there_are() -> None:
    with pytest.raises(UnknownSourceError, match="no scheme 'serial'; those known are lidar;"):
        open_source("serial:/dev/ttyUSB0", ReadOptions())


def test_a_topic_without_its_scheme_is_told_with_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    points = EntryPoints([EntryPoint("ros2", f"{__name__}:Lidar", sources.SOURCE_GROUP)])
    monkeypatch.setattr(sources, "entry_points", lambda group: points.select(group=group))
    with pytest.raises(FileError, match=r"/front/scan: no such file; .* said as ros2:/front/scan"):
        open_source("/front/scan", ReadOptions())
    folder = tmp_path / "scan"
    folder.mkdir()
    assert isinstance(open_source(str(folder), ReadOptions()), Recording)


def test_a_file_with_a_colon_in_its_name_is_a_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("run:1").write_bytes(FLASER * 3)
    source = open_source("run:1", ReadOptions())
    assert isinstance(source, Recording)
    assert (source.count(), source.live, len(list(source.scans()))) == (3, False, 3)


def test_a_dash_is_standard_input() -> None:
    source = open_source("-", ReadOptions())
    assert isinstance(source, StandardInput)
    assert source.live
    assert source.count() is None  # type: ignore[func-returns-value]  # as it says


def test_what_a_driver_writes_wrongly_is_told_while_it_writes(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    told: list[str] = []
    reading, writing = os.pipe()
    scan = b'{"ranges": [1.0, 2.0], "angle_min": 0.0, "angle_increment": 0.1}\n'
    with os.fdopen(reading) as driver:
        monkeypatch.setattr("sys.stdin", driver)
        os.write(writing, b"no scan\n" + scan)
        scans = open_source("-", ReadOptions(on_warning=told.append)).scans()
        assert next(scans).ranges.tolist() == [1.0, 2.0]
        assert told == ["standard input: line refused: line 1: is no JSON"]
        os.close(writing)
        assert list(scans) == []
