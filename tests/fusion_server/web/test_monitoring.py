"""What a monitor asks is answered as it is: alive, ready, and by numbers."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

import pytest
from prometheus_client.parser import text_string_to_metric_families

from mapweave_fusion_server import monitoring
from mapweave_fusion_server.web.feed import CoordinatorReport, RobotReport
from mapweave_protocol.wire.messages import StatusMessage

if TYPE_CHECKING:
    from tests.fusion_server.web.conftest import Page

Samples = dict[tuple[str, tuple[tuple[str, str], ...]], float]


def _samples(page: Page) -> Samples:
    answer = page.ask("/metrics")
    assert answer.status == 200
    return {
        (sample.name, tuple(sorted(sample.labels.items()))): sample.value
        for family in text_string_to_metric_families(answer.body.decode())
        for sample in family.samples
    }


def _robot(name: str, *, version: int, held: int | None, runs: int = 1) -> RobotReport:
    counts = dict.fromkeys(("scans_placed", "components", "submaps"), 1)
    fields = {"robot": name, "boot": "b", "stamp": 0.0, "state": "mapping"}
    status = StatusMessage.model_validate(
        {**counts, **fields, "scans_seen": 90, "scans_skipped": 4, "map_version": version}
    )
    return RobotReport(name, runs, status, 0.0, held)


def test_numbers_are_those_that_were_handed_over(page: Page) -> None:
    refusals = {("r1", "map"): 3, ('x" or\n', "pose"): 1}
    said = CoordinatorReport(refused=4, refusals=refusals, dropped=7, storing=False, damaged=2)
    page.feed.show_version(17, ())
    page.feed.show_team(
        (_robot("r1", version=9, held=7), _robot("r2", version=1, held=None, runs=0)), said
    )
    samples = _samples(page)
    assert samples["mapweave_version", ()] == 17
    assert samples["mapweave_storing", ()] == 0
    assert samples["mapweave_damaged_rows", ()] == 2
    assert samples["mapweave_dropped_total", ()] == 7
    assert samples["mapweave_refused_total", (("kind", "map"), ("sender", "r1"))] == 3
    assert samples["mapweave_refused_total", (("kind", "pose"), ("sender", 'x" or\n'))] == 1
    assert samples["mapweave_robot_map_lag", (("robot", "r1"),)] == 2
    assert samples["mapweave_robot_alive", (("robot", "r2"),)] == 0
    assert samples["mapweave_robot_scans_skipped", (("robot", "r1"),)] == 4
    assert 0 <= samples["mapweave_coordinator_age_seconds", ()] < 60


def test_a_coordinator_is_alive_while_its_loop_speaks(
    page: Page, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert page.ask("/healthz").status == 503, "it has not spoken yet"
    page.feed.show_team((), CoordinatorReport())
    assert page.ask("/healthz").status == 200
    assert page.ask("/readyz").status == 200
    monkeypatch.setattr(monitoring, "STALE", 0.01)
    time.sleep(0.05)
    answer = page.ask("/healthz")
    assert answer.status == 503
    assert b"no sign of the coordinator" in answer.body
    assert page.ask("/readyz").status == 503


def test_a_coordinator_that_cannot_store_is_alive_and_not_ready(page: Page) -> None:
    page.feed.show_team((), CoordinatorReport(storing=False))
    assert page.ask("/healthz").status == 200
    answer = page.ask("/readyz")
    assert answer.status == 503
    assert b"not stored" in answer.body


def test_before_it_coordinates_everything_can_be_asked_for(page: Page) -> None:
    assert page.ask("/metrics").status == 200
    assert page.ask("/readyz").status == 503
