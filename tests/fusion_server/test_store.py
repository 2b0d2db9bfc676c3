"""The store keeps what it was given, over restarts, and touches no file that is not its own."""

import sqlite3
from pathlib import Path

import pytest

from mapweave.errors import FileError
from mapweave_fusion_server.store import Store


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "team.sqlite"


def _fill(store: Store, versions: int) -> None:
    for number in range(1, versions + 1):
        store.add_version(number, 100.0 + number, f"version {number}".encode())


def test_a_new_store_is_empty(path: Path) -> None:
    with Store(path, "rescue") as store:
        assert store.latest_version == 0
        assert store.version(1) is None
        assert store.map_of("a") is None
        assert list(store.versions_since(0)) == []


def test_everything_is_still_there_after_a_restart(path: Path) -> None:
    with Store(path, "rescue") as store:
        series = store.series
        _fill(store, 3)
        store.keep_map(("a", "x"), 3, 5.0, b"old map")
        store.keep_map(("a", "x"), 3, 6.0, b"map")
        store.keep_map(("a", "w"), 1, 7.0, b"map of the run before")
        store.add_alignments(("b", "a"), 5.5, b"refused")
        store.add_alignments(("a", "b"), 6.5, b"accepted")
    with Store(path, "rescue") as store:
        assert store.series == series
        assert store.latest_version == 3
        assert store.version(2) == b"version 2"
        assert list(store.versions_since(1)) == [b"version 2", b"version 3"]
        assert store.map_of("a") == b"map"
        assert store.last_maps() == [b"map of the run before", b"map"]
        assert store.last_alignments() == [b"accepted"]


def test_a_number_far_ahead_is_reached_in_one_step(path: Path) -> None:
    """However it came there: to walk to it would take years."""
    with Store(path, "rescue") as store:
        _fill(store, 2)
    with sqlite3.connect(path) as database:
        database.execute("UPDATE version SET number = ? WHERE number = 2", (2**50,))
    database.close()
    with Store(path, "rescue") as store:
        assert store.latest_version == 2**50
        assert next(store.versions_since(0)) == b"version 1"
        assert list(store.versions_since(1)) == [b"version 2"]


def test_two_stores_count_different_series(tmp_path: Path) -> None:
    with Store(tmp_path / "1", "rescue") as one, Store(tmp_path / "2", "rescue") as two:
        assert one.series != two.series


@pytest.mark.parametrize("number", [0, 2, 5])
def test_versions_follow_each_other_without_a_gap(path: Path, number: int) -> None:
    with Store(path, "rescue") as store, pytest.raises(ValueError, match="does not follow"):
        store.add_version(number, 0.0, b"")


def test_news_is_what_came_after_the_last_version_was_begun(path: Path) -> None:
    with Store(path, "rescue") as store:
        assert not store.holds_news
        store.keep_map(("a", "x"), 0, 5.0, b"map")
        assert store.holds_news
        store.add_version(1, 6.0, b"version 1")
        assert not store.holds_news
        store.add_alignments(("a", "b"), 7.0, b"accepted")
        assert store.holds_news


def test_an_empty_file_becomes_a_store(path: Path) -> None:
    path.touch()
    with Store(path, "rescue") as store:
        _fill(store, 1)
    with Store(path, "rescue") as store:
        assert store.latest_version == 1


def _foreign_database(path: Path) -> None:
    connection = sqlite3.connect(path)
    connection.execute("CREATE TABLE mine (secret TEXT)")
    connection.close()


def _later_schema(path: Path) -> None:
    with Store(path, "rescue"):
        pass
    connection = sqlite3.connect(path)
    connection.execute("PRAGMA user_version = 99")
    connection.close()


def _cut_off(path: Path) -> None:
    with Store(path, "rescue") as store:
        for number in range(1, 20):
            store.add_version(number, 0.0, bytes(4000))
    path.write_bytes(path.read_bytes()[:3000])  # its first page is not there


def _overwritten(path: Path) -> None:
    with Store(path, "rescue") as store:
        _fill(store, 3)
    content = bytearray(path.read_bytes())
    content[100:8000] = b"\xa5" * 7900
    path.write_bytes(content)


@pytest.mark.parametrize(
    ("make", "problem"),
    [
        (lambda path: path.write_text("a diary, long enough to have a header of 100 bytes " * 9),
         "not a mapweave store"),
        (lambda path: path.write_bytes(b"SQLite"), "not a mapweave store"),
        (_foreign_database, "another program's"),
        (_later_schema, "schema 99, of a later mapweave, expected 3"),
        (_cut_off, "damaged"),
        (_overwritten, "damaged"),
    ],
)  # fmt: skip
def test_a_file_that_is_no_store_is_named_and_left_as_it_was(
    path: Path, make: object, problem: str
) -> None:
    assert callable(make)
    make(path)
    before = path.read_bytes()
    with pytest.raises(FileError, match=problem) as caught:
        Store(path, "rescue")
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)
    assert path.read_bytes() == before
    assert sorted(path.parent.iterdir()) == [path]


def test_a_folder_is_no_store(tmp_path: Path) -> None:
    with pytest.raises(FileError, match="not a file"):
        Store(tmp_path, "rescue")


def test_a_store_in_a_folder_that_is_missing_is_an_error_that_names_it(tmp_path: Path) -> None:
    with pytest.raises(FileError, match="nowhere"):
        Store(tmp_path / "nowhere" / "team.sqlite", "rescue")


def test_a_store_belongs_to_one_team(path: Path) -> None:
    with Store(path, "rescue"):
        pass
    with pytest.raises(FileError, match="team 'rescue', expected team 'office'"):
        Store(path, "office")


def test_a_store_has_one_server(path: Path) -> None:
    with Store(path, "rescue"), pytest.raises(FileError, match="in use"):
        Store(path, "rescue")


def test_who_says_since_which_version_gets_what_that_has_not(tmp_path: Path) -> None:
    with Store(tmp_path / "store.sqlite", "t") as store:
        store.keep_map(("a", "x"), 0, 0.0, b"a")
        store.add_alignments(("a@x", "b@x"), 0.0, b"ab")
        store.add_version(1, 0.0, b"1")
        store.keep_map(("b", "x"), 0, 0.0, b"b")
        store.add_alignments(("a@x", "c@x"), 0.0, b"ac")
        store.renew_alignments(("b@x", "a@x"), b"AB")  # says the same: no news
        assert store.maps_since(None) == store.maps_since(0) == [b"a", b"b"]
        assert store.maps_since(1) == [b"b"]
        assert store.alignments_since(None) == [b"AB", b"ac"]
        assert store.alignments_since(1) == [b"ac"]
        assert store.map_of("a", "x") == b"a"
        assert store.map_of("a", "y") is None


def test_marks_and_orders_are_remembered_and_are_news(tmp_path: Path) -> None:
    with Store(tmp_path / "store.sqlite", "rescue") as store:
        store.add_version(1, 1.0, b"version")
        assert not store.holds_news
        store.keep_marks(("a", "x"), 2.0, b"first")
        store.keep_marks(("a", "x"), 3.0, b"second")
        store.keep_marks(("a", "y"), 3.0, b"of y")
        assert store.holds_news
        store.add_version(2, 4.0, b"version")
        store.add_order("o2", 5.0, b"two")
        store.add_order("o1", 5.0, b"one")
        assert store.holds_news
    with Store(tmp_path / "store.sqlite", "rescue") as store:
        assert store.last_marks() == [b"second", b"of y"]
        assert store.orders() == [b"two", b"one"]
        assert store.holds_news


def test_a_run_is_found_by_any_of_its_components(tmp_path: Path) -> None:
    with Store(tmp_path / "store.sqlite", "rescue") as store:
        store.keep_map(("a", "y"), 4, 1.0, b"later")
        store.keep_map(("a", "x"), 1, 1.0, b"earlier")
        store.keep_map(("b", "z"), 0, 1.0, b"another")
        found = [store.map_with_component("a", number) for number in range(6)]
        assert found == [b"earlier"] * 2 + [b"later"] * 3 + [None]
        store.keep_map(("a", "w"), 4, 1.0, b"of the same numbers")
        named = [store.map_with_component(f"a@{boot}", 4) for boot in "yw"]
        assert named == [b"later", b"of the same numbers"]
        assert store.map_with_component("a@v", 0) is None
        assert sorted(store.runs()) == [("a", "w", 4), ("a", "x", 1), ("a", "y", 4), ("b", "z", 0)]
