"""On a full disk the coordinator goes on, says so, and stores again when there is room."""

from __future__ import annotations

import resource
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from mapweave_fusion_server.storage.database import UnwritableError
from mapweave_fusion_server.store import Store

if TYPE_CHECKING:
    from tests.fusion_server.conftest import MakeMap, Network, StartServer

PAGES = 30


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    with Store(tmp_path / "store.sqlite", "rescue") as store:
        store.add_version(1, 1.0, b"version 1")
        store._database.rows(f"PRAGMA max_page_count = {PAGES}")
        yield store


def _make_room(store: Store) -> None:
    store._database.rows("PRAGMA max_page_count = 100000")


def test_a_version_that_does_not_fit_is_refused_and_leaves_the_store_as_it_was(
    store: Store,
) -> None:
    with pytest.raises(UnwritableError, match="cannot be written"):
        store.add_version(2, 2.0, bytes(PAGES * 4096))
    assert store.latest_version == 1
    store.add_version(2, 2.0, b"version 2")
    assert store.version(2) == b"version 2"


def test_what_does_not_fit_waits_and_is_answered_from_meanwhile(store: Store) -> None:
    series, large = store.series, bytes(PAGES * 4096)
    store.keep_map(("a", "x"), 0, 1.0, large)
    store.add_alignments(("b", "a"), 1.0, b"found")
    with pytest.raises(UnwritableError):
        store.add_version(2, 2.0, large)
    store.hold()
    store.add_version(2, 2.0, b"version 2")
    store.add_version(3, 3.0, b"version 3")
    assert not store.is_storing
    assert not store.resume()
    assert store.series != series, "what may be lost has other names"
    assert store.latest_version == 3
    assert [*store.versions_since(0)] == [b"version 1", b"version 2", b"version 3"]
    assert store.versions_created(1, 9) == [(2, 2.0), (3, 3.0)]
    assert store.map_of("a") == large


def test_where_there_is_room_for_little_a_version_that_needs_more_waits(store: Store) -> None:
    large = bytes(PAGES * 4096)
    with pytest.raises(UnwritableError):
        store.add_version(2, 2.0, large)
    store.hold()  # what names its series would fit by itself
    store.add_version(2, 2.0, large)
    assert not store.is_storing
    assert store.version(2) == large
    store.add_version(3, 3.0, b"version 3")
    assert store.latest_version == 3
    _make_room(store)
    assert store.resume()
    assert [*store.versions_since(1)] == [large, b"version 3"]


def test_what_waited_is_stored_when_there_is_room(store: Store) -> None:
    store.keep_map(("a", "x"), 0, 1.0, bytes(PAGES * 4096))
    store.add_alignments(("b", "a"), 1.0, b"found")
    store.hold()
    store.add_version(2, 2.0, b"version 2")
    held = store.series
    _make_room(store)
    assert store.resume()
    assert store.is_storing
    store.__exit__(None, None, None)
    with Store(store.path, "rescue") as again:
        assert again.series == held
        assert again.version(2) == b"version 2"
        assert again.map_of("a") == bytes(PAGES * 4096)
        assert again.last_alignments() == [b"found"]
        assert not again.holds_news
    store.__init__(store.path, "rescue")  # type: ignore[misc]  # the fixture closes it


def test_versions_lost_with_the_process_are_numbered_again_in_another_series(
    tmp_path: Path,
) -> None:
    path = tmp_path / "store.sqlite"
    with Store(path, "rescue") as store:
        store.add_version(1, 1.0, b"version 1")
        store._database.rows(f"PRAGMA max_page_count = {PAGES}")
        store.keep_map(("a", "x"), 0, 1.0, bytes(PAGES * 4096))
        store.hold()
        store.add_version(2, 2.0, b"never stored")
        lost = store.series
    with Store(path, "rescue") as store:
        assert store.latest_version == 1
        assert store.series != lost


@pytest.mark.skipif(not hasattr(resource, "prlimit"), reason="a limit of another process: Linux")
def test_a_running_coordinator_survives_a_full_disk(
    network: Network, start_server: StartServer, make_map: MakeMap
) -> None:
    server, watcher = start_server(), network.watcher()
    with network.robot("a") as a:
        a.publish_map(make_map("a"))
        assert watcher.next().version == 1
        server.limit_files(64 * 1024)
        for version in range(2, 12):
            a.publish_map(make_map("a", version, components=version % 4 + 1))
            assert watcher.next().version == version
        server.wait_for_log("going on without it until there is room")
        server.limit_files(None)
        server.wait_for_log("can be written again")
        a.publish_map(make_map("a", 12))
        last = watcher.next().version
    assert server.stop() == 0
    with Store(server.store, network.team) as store:
        assert store.latest_version == last
        assert store.version(last) is not None
