"""Damage costs what is damaged."""

import logging
import sqlite3
from pathlib import Path

import pytest

from mapweave_fusion_server.storage.view import StoreView
from mapweave_fusion_server.store import Store
from mapweave_protocol.wire.model import MAX_COUNT

VERSIONS = 40


@pytest.fixture
def path(tmp_path: Path) -> Path:
    path = tmp_path / "store.sqlite"
    with Store(path, "rescue") as store:
        for number in range(1, VERSIONS + 1):
            store.add_version(number, float(number), _message(number))
        store.keep_map(("a", "x"), 0, 1.0, b"map of a" * 100)
        store.keep_map(("b", "y"), 0, 1.0, b"map of b" * 100)
        store.add_alignments(("a", "b"), 1.0, b"found" * 100)
        store.keep_marks(("a", "x"), 1.0, b"marks of a")
        store.add_order("o1", 1.0, b"an order")
    return path


def _message(number: int) -> bytes:
    return f"version {number} ".encode() * 500


def _change(path: Path, before: bytes, after: bytes) -> None:
    content = path.read_bytes()
    assert before in content
    assert len(before) == len(after)
    path.write_bytes(content.replace(before, after, 1))


def test_a_message_with_a_byte_wrong_is_left_out_and_told_once(
    path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    _change(path, b"version 7 version 7 ", b"version 7 versiom 7 ")
    with Store(path, "rescue") as store:
        assert store.version(7) is None
        assert store.version(7) is None
        assert store.version(8) == _message(8)
        assert len(list(store.versions_since(0))) == VERSIONS - 1
        assert store.damaged == 1
    assert len([r for r in caplog.records if "version 7" in r.getMessage()]) == 1


def test_a_damaged_map_costs_that_map(path: Path) -> None:
    _change(path, b"map of amap of a", b"map of bmap of a")
    with Store(path, "rescue") as store:
        assert store.last_maps() == [b"map of b" * 100]
        assert store.map_of("a") is None
        assert store.last_alignments() == [b"found" * 100]


def test_a_store_whose_pages_are_damaged_is_saved_as_far_as_it_can_be_read(
    path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.WARNING)
    with Store(path, "rescue") as store:
        series = store.series
    whole = path.read_bytes()
    first = whole.index(b"version 20 version 20")
    page = first // 4096
    damaged = bytearray(whole)
    damaged[page * 4096 : (page + 1) * 4096] = b"\xa5" * 4096
    path.write_bytes(damaged)
    with Store(path, "rescue") as store:
        kept = [n for n in range(1, VERSIONS + 1) if store.version(n) is not None]
        assert len(kept) >= VERSIONS - 5
        assert all(store.version(n) == _message(n) for n in kept)
        assert store.last_maps() == [b"map of a" * 100, b"map of b" * 100]
        assert store.last_marks() == [b"marks of a"]
        assert store.orders() == [b"an order"]
        assert store.series != series, "the last versions may be among the lost ones"
        store.add_version(store.latest_version + 1, 0.0, b"the next one")
    [aside] = path.parent.glob("store.sqlite.damaged-*")
    assert aside.read_bytes() == bytes(damaged)
    assert str(aside) in caplog.text
    with Store(path, "rescue") as store:
        assert store.version(store.latest_version) == b"the next one"


@pytest.mark.parametrize("share", [0.95, 0.7, 0.3])
def test_of_a_store_that_was_cut_off_what_is_there_is_read(path: Path, share: float) -> None:
    whole = path.read_bytes()
    path.write_bytes(whole[: int(share * len(whole))])
    with Store(path, "rescue") as store:
        kept = [n for n in range(1, VERSIONS + 1) if store.version(n) is not None]
        assert len(kept) >= (share - 0.25) * VERSIONS
        assert all(store.version(n) == _message(n) for n in kept)
    [aside] = path.parent.glob("store.sqlite.damaged-*")
    assert len(aside.read_bytes()) == int(share * len(whole))


def test_the_root_of_a_table_lost_costs_that_table(path: Path) -> None:
    damaged = bytearray(path.read_bytes())
    damaged[2 * 4096 : 3 * 4096] = bytes(4096)  # of the versions
    path.write_bytes(damaged)
    with Store(path, "rescue") as store:
        assert store.latest_version == 0
        assert len(store.last_maps()) == 2
        assert store.holds_news
        store.add_version(1, 0.0, b"of another series")


@pytest.mark.parametrize("page", range(3, 20))
def test_a_page_lost_anywhere_leaves_most_of_the_store(path: Path, page: int) -> None:
    damaged = bytearray(path.read_bytes())
    damaged[page * 4096 : (page + 1) * 4096] = bytes(4096)
    path.write_bytes(damaged)
    with Store(path, "rescue") as store:
        kept = [n for n in range(1, VERSIONS + 1) if store.version(n) is not None]
        assert all(store.version(n) == _message(n) for n in kept)
        assert len(kept) + len(store.last_maps()) + len(store.last_alignments()) > VERSIONS // 2


def test_a_store_without_its_owner_goes_on_in_a_new_series(path: Path) -> None:
    with Store(path, "rescue") as store:
        series = store.series
    connection = sqlite3.connect(path)
    connection.execute("DELETE FROM owner")
    connection.commit()
    connection.close()
    with Store(path, "rescue") as store:
        assert store.series != series
        assert store.latest_version == VERSIONS


@pytest.mark.parametrize("message", [b"version 3 version 3 ", b"found", b"map of b", b"marks of a"])
def test_a_bit_wrong_beside_a_message_costs_no_more_than_that_row(
    path: Path, message: bytes
) -> None:
    """Numbers, times, names, and what SQLite notes of each: bits of the 24 bytes before it."""
    whole = path.read_bytes()
    start = whole.index(message)
    for bit in range(8 * (start - 24), 8 * start, 5):
        content = bytearray(whole)
        content[bit // 8] ^= 1 << bit % 8
        path.write_bytes(content)
        with Store(path, "rescue") as store:
            latest = store.latest_version
            assert VERSIONS - 1 <= latest <= MAX_COUNT
            assert len(list(store.versions_since(0))) >= VERSIONS - 2
            assert len(store.last_maps()) >= 1
            assert len(store.versions_created(0, 99)) >= VERSIONS - 2
            assert store.orders() == [b"an order"]
            store.add_version(latest + 1, 1.0, b"another")
            store.keep_map(("c", "z"), 0, 1.0, b"map of c")
        with StoreView(path) as view:
            assert view.versions(99)
        assert not any(path.parent.glob("*-wal"))
