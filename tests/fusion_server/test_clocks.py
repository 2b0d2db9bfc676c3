"""A real coordinator whose clock is set back between two starts."""

from __future__ import annotations

import signal
from typing import TYPE_CHECKING

from mapweave_fusion_server.store import Store

if TYPE_CHECKING:
    from pathlib import Path

    import pytest

    from tests.fusion_server.conftest import MakeMap, Network, StartServer

NOT_YET = 1000.0  # [s] until the next version
DAY = 86400.0  # [s]
A_DAY_BACK = f"""
import time
now = time.time
time.time = lambda: now() - {DAY}
"""


def test_a_map_stored_before_the_clock_went_a_day_back_is_in_the_next_version(
    network: Network,
    start_server: StartServer,
    make_map: MakeMap,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    first = start_server(interval=NOT_YET)
    watcher = network.watcher()
    with network.robot("a") as a:
        a.publish_map(make_map("a"))
        assert watcher.next().version == 1
        a.publish_map(make_map("a", 2, components=2))
        first.wait_for_log("a: 2 submaps")  # stored, and in no version yet
        first.stop(signal.SIGKILL)
    (tmp_path / "sitecustomize.py").write_text(A_DAY_BACK)  # what each Python process starts with
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    again = start_server()  # its robot is gone: nothing that is new comes
    joint = watcher.next()
    while len(joint.components) < 2:
        joint = watcher.next()
    again.stop()
    with Store(tmp_path / "store.sqlite", network.team) as store:
        times = [at for _, at in store.versions_created(0, 100)]
    assert times[-1] < times[0] - DAY / 2, "its clock was not a day back"
