"""A server that ends and comes back: nothing is lost, no number is used twice or skipped."""

from __future__ import annotations

import signal
import threading
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING

import pytest

from mapweave.team.joint_builder import JointMapBuilder
from mapweave_fusion_server.coordinator import CoordinatorParameters
from mapweave_fusion_server.service import Service
from mapweave_fusion_server.store import Store

if TYPE_CHECKING:
    from pathlib import Path

    from tests.fusion_server.conftest import Found, MakeMap, Network, ServerProcess, StartServer


NOT_YET = 1000.0  # [s] until the next version


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGKILL])
def test_after_a_restart_the_latest_is_published_again_and_numbering_goes_on(
    network: Network,
    finished_team: ServerProcess,
    start_server: StartServer,
    make_map: MakeMap,
    how: int,
) -> None:
    finished_team.stop(how)
    watcher = network.watcher()
    start_server()
    assert watcher.next().version == 3
    with network.robot("c") as c:
        c.publish_map(make_map("c"))
        following = watcher.next()
    assert following.version == 4
    assert network.groups(following) == [["a/0", "b/0"], ["c/0"]]


def test_what_was_told_before_a_restart_is_not_told_again_in_the_next_version(
    network: Network,
    finished_team: ServerProcess,
    start_server: StartServer,
    make_map: MakeMap,
) -> None:
    assert "a/0 and b/0: accepted" in finished_team.log
    finished_team.stop(signal.SIGKILL)
    server = start_server()
    watcher = network.watcher()
    with network.robot("c") as c:
        c.publish_map(make_map("c"))
        while watcher.next().version < 4:
            pass
    server.stop()
    assert "c: 1 submap" in server.log
    assert "a/0" not in server.log


def test_nothing_new_after_a_restart_makes_no_version(
    network: Network,
    finished_team: ServerProcess,
    start_server: StartServer,
    found: Found,
) -> None:
    finished_team.stop()
    server = start_server()
    with network.robot("a") as a:
        a.publish_map(found[0])
        server.wait_for_log("a is here")
    server.wait_for_log("a is gone")
    assert server.stop() == 0
    with Store(server.store, network.team) as store:
        assert store.latest_version == 3


def test_the_first_signal_publishes_what_is_pending(
    network: Network, start_server: StartServer, make_map: MakeMap
) -> None:
    server = start_server(interval=1e6)
    watcher = network.watcher()
    with network.robot("a") as a:
        a.publish_map(make_map("a"))
        assert watcher.next().version == 1
        a.publish_map(make_map("a", 2, components=2))
        server.wait_for_log("a: 2 submaps")
        assert server.stop(signal.SIGTERM) == 0
    assert network.groups(watcher.next()) == [["a/0"], ["a/1"]]


@pytest.mark.parametrize("waits", [True, False])
def test_what_waits_for_the_next_version_is_news_to_who_starts_again(
    network: Network,
    make_map: MakeMap,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    waits: bool,
) -> None:
    monkeypatch.setattr(JointMapBuilder, "has_more", waits)
    stop = threading.Event()
    parameters = CoordinatorParameters(min_interval=NOT_YET)
    watcher = network.watcher()
    with Store(tmp_path / "store.sqlite", network.team) as store, ThreadPoolExecutor(1) as thread:
        service = Service(network.connect(), network.team, store, parameters)
        served = thread.submit(service.run, stop.is_set)
        try:
            with network.robot("a") as a:
                a.publish_map(make_map("a"))
                assert watcher.next().version == 1
                assert store.holds_news is waits
        finally:
            stop.set()
        served.result()
