"""A store of an earlier form is brought up to this one, with all that it holds."""

import sqlite3
from pathlib import Path

import pytest

from mapweave.errors import FileError
from mapweave_fusion_server.storage.schema import APPLICATION_ID
from mapweave_fusion_server.storage.view import StoreView
from mapweave_fusion_server.store import Store

SCHEMA_2 = f"""
PRAGMA application_id = {APPLICATION_ID};
PRAGMA user_version = 2;
CREATE TABLE owner (team TEXT NOT NULL, series TEXT NOT NULL);
CREATE TABLE version (number INTEGER PRIMARY KEY, created REAL NOT NULL, message BLOB NOT NULL);
CREATE TABLE alignment (
    id INTEGER PRIMARY KEY, received REAL NOT NULL, first TEXT NOT NULL, second TEXT NOT NULL,
    message BLOB NOT NULL);
CREATE INDEX alignment_pair ON alignment (first, second);
CREATE TABLE robot_map (
    robot TEXT NOT NULL, boot TEXT NOT NULL, last_component INTEGER NOT NULL,
    received REAL NOT NULL, message BLOB NOT NULL, PRIMARY KEY (robot, boot));
INSERT INTO owner VALUES ('rescue', 'abc');
INSERT INTO version VALUES (1, 2.0, x'01'), (2, 5.0, x'02');
INSERT INTO alignment VALUES (1, 1.0, 'a', 'b', x'03'), (2, 4.0, 'a', 'b', x'04');
"""
A_MAP = "INSERT INTO robot_map VALUES ('a', 'x', 0, {received}, x'05');"


def _schema_2(path: Path, *, received: float) -> None:
    connection = sqlite3.connect(path)
    connection.executescript(SCHEMA_2 + A_MAP.format(received=received))
    connection.close()


@pytest.mark.parametrize(("received", "news"), [(3.0, False), (6.0, True)])
def test_a_store_of_schema_2_is_brought_up(tmp_path: Path, received: float, news: bool) -> None:
    path = tmp_path / "store.sqlite"
    _schema_2(path, received=received)
    for _ in range(2):
        with Store(path, "rescue") as store:
            assert store.series == "abc"
            assert [*store.versions_since(0)] == [b"\x01", b"\x02"]
            assert store.last_alignments() == [b"\x04"]
            assert store.last_maps() == [b"\x05"]
            assert store.holds_news is news
            assert store.damaged == 0


def test_a_store_of_schema_2_is_not_changed_by_who_only_looks(tmp_path: Path) -> None:
    path = tmp_path / "store.sqlite"
    _schema_2(path, received=3.0)
    before = path.read_bytes()
    with pytest.raises(FileError, match="schema 2, expected 3"):
        StoreView(path)
    assert path.read_bytes() == before


def test_what_is_news_does_not_depend_on_the_clock(tmp_path: Path) -> None:
    with Store(tmp_path / "store.sqlite", "rescue") as store:
        store.keep_map(("a", "x"), 0, 1e9, b"map")
        store.add_version(1, 1e9, b"version")
        assert not store.holds_news
        store.keep_map(("a", "x"), 0, 0.0, b"map")  # set back by years
        assert store.holds_news
        seen = store.news
        store.keep_map(("a", "x"), 0, 0.0, b"map")
        store.add_version(2, 2e9, b"version", seen)  # and forth: it came while it was built
        assert store.holds_news


@pytest.mark.parametrize(("schema", "whose"), [(1, "an earlier"), (99, "a later")])
def test_a_store_of_a_schema_unknown_here_is_left_as_it_is_and_it_says_whose(
    tmp_path: Path, schema: int, whose: str
) -> None:
    path = tmp_path / "store.sqlite"
    with Store(path, "rescue") as store:
        store._database.rows(f"PRAGMA user_version = {schema}")
    before = path.read_bytes()
    for look in (StoreView, Store):
        with pytest.raises(FileError, match=f"schema {schema}, of {whose} mapweave, expected 3$"):
            look(path, "rescue")
    assert path.read_bytes() == before
