"""Numbers that were told are not given again: a copy counts in a series of its own."""

import shutil
from pathlib import Path

import pytest

from mapweave_fusion_server.storage.view import StoreView
from mapweave_fusion_server.store import Store


@pytest.fixture
def path(tmp_path: Path) -> Path:
    path = tmp_path / "store.sqlite"
    with Store(path, "rescue") as store:
        store.add_version(1, 1.0, b"version 1")
    return path


def _series(path: Path) -> str:
    with Store(path, "rescue") as store:
        assert store.version(1) == b"version 1"
        return store.series


def test_a_store_that_is_moved_keeps_its_series(path: Path) -> None:
    series = _series(path)
    assert _series(path.rename(path.with_name("other.sqlite"))) == series


def test_a_copied_store_begins_a_series_once(path: Path) -> None:
    series = _series(path)
    copy = Path(shutil.copy(path, path.with_name("copy.sqlite")))
    of_copy = _series(copy)
    assert of_copy != series
    assert _series(copy) == of_copy
    assert _series(path) == series


def test_a_backup_taken_while_the_coordinator_goes_on_begins_a_series(path: Path) -> None:
    backup = path.with_name("backup.sqlite")
    with Store(path, "rescue") as store:
        store.add_version(2, 2.0, b"version 2")
        with StoreView(path) as view:
            view.backup(backup)
        store.add_version(3, 3.0, b"version 3")
        series = store.series
    with Store(backup, "rescue") as store:
        assert store.latest_version == 2
        assert store.version(2) == b"version 2"
        assert store.series != series


def test_a_backup_copied_over_the_store_in_place_begins_a_series(path: Path) -> None:
    series, backup = _series(path), path.with_name("backup.sqlite")
    with StoreView(path) as view:
        view.backup(backup)
    with path.open("wb") as file:  # the same file still, for the system
        file.write(backup.read_bytes())
    assert _series(path) != series
