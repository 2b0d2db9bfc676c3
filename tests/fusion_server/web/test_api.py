"""What programs are answered."""

import json
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from unittest.mock import Mock

import numpy as np
import pytest

from mapweave.geometry import se2
from mapweave.io.map_files import read_joint
from mapweave.maps import Alignment, LineMap, RobotMap
from mapweave.reasons import Reason
from mapweave_fusion_server import journal
from mapweave_fusion_server.web import server
from mapweave_fusion_server.web.api import Api
from mapweave_fusion_server.web.events import Bell
from mapweave_fusion_server.web.feed import CoordinatorReport, RobotReport
from mapweave_fusion_server.web.orders import PageOrders
from mapweave_protocol.wire.messages import StatusMessage
from tests.fusion_server.web.conftest import Page, make_joint

HOSTILE = "</script><script>alert(1)</script>"


def test_the_latest_version_is_a_joint_map_that_is_read_again(
    page: Page, lines: LineMap, tmp_path: Path
) -> None:
    page.publish(make_joint(1, lines, a=0.0))
    page.publish(make_joint(2, lines, a=0.0, b=3.0))
    file = tmp_path / "joint.json"
    file.write_bytes(page.ask("/api/joint").body)
    joint = read_joint(file)
    assert joint.version == 2
    assert set(joint.components[0].robots) == {"a/0", "b/0"}
    assert np.allclose(joint.components[0].map.segments, lines.segments, atol=1e-3)


def test_each_version_stays_what_it_was(page: Page, lines: LineMap) -> None:
    for version in (1, 2, 3):
        page.publish(make_joint(version, lines, a=float(version)))
    for version in (1, 2, 3):
        content = page.ask(f"/api/joint/{version}").json
        assert content["version"] == version
        assert content["components"][0]["robots"]["a/0"][0] == version


def test_versions_since_one_come_in_order_and_no_more_than_wanted(
    page: Page, lines: LineMap
) -> None:
    for version in range(1, 6):
        page.publish(make_joint(version, lines, a=0.0))
    since = page.ask("/api/joint?since=2&limit=2").json
    assert since["latest"] == 5
    assert [joint["version"] for joint in since["versions"]] == [3, 4]
    assert page.ask("/api/joint?since=5").json["versions"] == []


@pytest.mark.parametrize("path", ["/api/joint", "/api/joint/1", "/api/joint/0", "/api/joint/9.svg"])
def test_a_version_that_is_not_there_is_told_in_one_line(page: Page, path: str) -> None:
    answer = page.ask(path)
    assert answer.status == 404
    assert re.fullmatch(rb"no version \d of the joint map; there is none yet\n", answer.body)


@pytest.mark.parametrize("since", ["-1", "x", "1e3", "9" * 400, "%D9%A1"])
def test_a_number_that_is_none_is_told(page: Page, since: str) -> None:
    answer = page.ask(f"/api/joint?since={since}")
    assert answer.status == 400
    assert b"expected a number" in answer.body


def test_the_times_of_all_versions_are_listed(page: Page, lines: LineMap) -> None:
    for version in (1, 2):
        page.publish(make_joint(version, lines, a=0.0))
    content = page.ask("/api/versions").json
    assert content["series"] == page.store.series
    assert content["versions"] == [[1, 1001.0], [2, 1002.0]]
    assert page.ask("/api/versions?since=1").json["versions"] == [[2, 1002.0]]


def test_what_came_from_the_network_cannot_end_a_script(page: Page, lines: LineMap) -> None:
    page.publish(make_joint(1, lines, reason=HOSTILE, a=0.0, b=1.0))
    for path in ("/api/joint", "/api/alignments"):
        answer = page.ask(path)
        assert b"<" not in answer.body
        assert HOSTILE in json.dumps(answer.json)
        assert answer.headers["Content-Type"] == "application/json"


def test_the_alignments_are_those_of_the_latest_version(page: Page, lines: LineMap) -> None:
    assert page.ask("/api/alignments").json == {"version": 0, "alignments": []}
    page.publish(make_joint(1, lines, reason="why", a=0.0, b=1.0))
    content = page.ask("/api/alignments").json
    assert content["version"] == 1
    assert [(a["reference"], a["other"], a["reason"]) for a in content["alignments"]] == [
        ("a/0", "b/0", "why")
    ]


def test_robots_are_told_as_they_were_reported(
    page: Page, make_map: Callable[..., RobotMap]
) -> None:
    status = StatusMessage(
        robot="a", boot="first", stamp=1.0, state="mapping", scans_seen=9, scans_placed=8,
        scans_total=20, components=1, submaps=2, map_version=5,
    )  # fmt: skip
    page.feed.show_version(0, (make_map("silent"),))
    page.feed.show_team((RobotReport("a", 1, status, 99.0, 4),), CoordinatorReport("b", 1.0, 100.0))
    told = page.ask("/api/robots").json
    a, silent = told["robots"]
    assert (a["robot"], a["alive"], a["heard"], a["map_version"]) == ("a", True, 99.0, 4)
    assert (a["status"]["scans_placed"], a["status"]["map_version"]) == (8, 5)
    assert a["status"]["boot"] == "first"
    assert (silent["robot"], silent["alive"], silent["status"]) == ("silent", False, None)
    assert told["coordinator"]["stamp"] == 100.0


def test_a_robots_own_lines_are_told(page: Page, make_map: Callable[..., RobotMap]) -> None:
    robot_map = make_map("a")
    page.feed.show_version(0, (robot_map,))
    part = page.ask("/api/parts/a/0").json
    assert part["segments"] == np.round(robot_map.lines(0).segments, 3).tolist()
    assert page.ask("/api/parts/a/1").status == 404
    assert page.ask("/api/parts/nobody/0").status == 404


def test_evidence_shows_which_wall_is_shared_and_which_contradicted(
    page: Page, make_map: Callable[..., RobotMap]
) -> None:
    """Laid rightly all of the wall is shared; moved into the room it contradicts."""
    first, second = make_map("a", pose=(1.0, 1.0, 0.3)), make_map("b", pose=(3.0, 2.0, -2.0))
    right = se2.between((1.0, 1.0, 0.3), (3.0, 2.0, -2.0))
    wrong = se2.compose(np.array([2.0, 1.5, 0.0]), right)
    cause = Reason.words("for a test")
    alignments = tuple(
        Alignment("a/0", "b/0", transform, "accepted", 0.9, cause) for transform in (right, wrong)
    )
    joint = replace(make_joint(1, first.lines(0), a=0.0), alignments=alignments)
    page.publish(joint, (first, second))
    good, bad = (page.ask(f"/api/joint/1/evidence/{k}").json["best"] for k in (0, 1))
    assert len(good["shared"]) > 100
    assert good["contradicted"] == []
    assert len(bad["shared"]) < len(good["shared"]) / 3
    assert len(bad["contradicted"]) > 50
    assert page.ask("/api/joint/1/evidence/2").status == 404


def test_a_version_is_taken_home_as_a_file(page: Page, lines: LineMap) -> None:
    page.publish(make_joint(1, lines, a=0.0))
    answer = page.ask("/api/joint/1.geojson")
    assert answer.headers["Content-Disposition"] == 'attachment; filename="joint-1.geojson"'
    assert answer.json["type"] == "FeatureCollection"
    assert page.ask("/api/joint/1.json").json == page.ask("/api/joint/1").json
    assert page.ask("/api/joint/1.exe").status == 404


def test_what_the_journal_told_is_told_again(page: Page, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level("INFO")
    journal.record(["r1 is here", "a\x1b[31m name"])
    lines = page.ask("/api/story").json["lines"]
    assert [line["text"] for line in lines] == ["r1 is here", "a?[31m name"]
    assert page.ask(f"/api/story?since={lines[0]['number']}").json["lines"] == lines[1:]


def test_the_description_names_everything_that_can_be_asked_for(page: Page) -> None:
    described = page.ask("/api/openapi.json").json["paths"]
    served = [*Api(Mock(), Bell()).routes, *PageOrders(Mock()).routes]
    routes = {route.path.replace(":int", "") for route in served}
    assert set(described) == routes


def test_the_page_names_no_other_server() -> None:
    for file in server.STATIC.iterdir():
        text = file.read_text(encoding="utf-8")
        addresses = set(re.findall(r"https?://[^\s\"'`]+", text))
        assert addresses <= {"http://www.w3.org/2000/svg"}, file
        assert "innerHTML" not in text
        assert not re.search(r"\son\w+=|\sstyle=|javascript:", text), file
