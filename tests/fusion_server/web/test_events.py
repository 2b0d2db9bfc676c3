"""What changes is told as it changes, and nothing twice or not at all."""

import json
from itertools import islice

import pytest

from mapweave.maps import LineMap
from mapweave_fusion_server import journal
from mapweave_fusion_server.web.feed import CoordinatorReport, Feed
from tests.fusion_server.web.conftest import Page, make_joint, make_pose


def publish(page: Page, lines: LineMap, first: int, last: int) -> None:
    for version in range(first, last + 1):
        page.publish(make_joint(version, lines, a=0.0))


def test_who_comes_first_hears_the_latest_version_and_each_that_follows(
    page: Page, lines: LineMap
) -> None:
    publish(page, lines, 1, 3)
    with page.events() as events:
        versions = (event for event in events if event["event"] == "version")
        assert next(versions)["id"] == "3"
        publish(page, lines, 4, 6)
        assert [event["id"] for event in islice(versions, 3)] == ["4", "5", "6"]


@pytest.mark.parametrize("had", [1, 4, 7])
def test_who_comes_again_hears_all_that_was_missed_in_order(
    page: Page, lines: LineMap, had: int
) -> None:
    publish(page, lines, 1, 7)
    with page.events({"Last-Event-ID": str(had)}) as events:
        versions = (event for event in events if event["event"] == "version")
        publish(page, lines, 8, 9)
        heard = [int(event["id"]) for event in islice(versions, 9 - had)]
        assert heard == list(range(had + 1, 10))


@pytest.mark.parametrize("had", ["99", "x", "-1", "1 2"])
def test_who_has_a_version_of_another_store_hears_the_latest(
    page: Page, lines: LineMap, had: str
) -> None:
    publish(page, lines, 1, 2)
    with page.events({"Last-Event-ID": had}) as events:
        first = next(event for event in events if event["event"] == "version")
    assert json.loads(first["data"])["version"] == 2
    assert json.loads(first["data"])["series"] == page.store.series


def test_reports_and_lines_are_told_without_an_id(
    page: Page, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level("INFO")
    with page.events() as events:
        assert next(events)["event"] == "team"
        journal.record(["r1 is here"])
        story = next(event for event in events if event["event"] == "story")
        page.feed.show_team((), CoordinatorReport(stamp=5.0))
        team = next(event for event in events if event["event"] == "team")
    assert json.loads(story["data"])["lines"][0]["text"] == "r1 is here"
    assert json.loads(team["data"])["coordinator"]["stamp"] == 5.0
    assert "id" not in story
    assert "id" not in team


def test_where_a_robot_is_is_told_when_it_says_so_and_only_then(page: Page) -> None:
    with page.events() as events:
        assert next(events)["event"] == "team"
        page.feed.positions.take(make_pose("r1", 1.0))
        first = next(events)
        page.feed.positions.take(make_pose("r1", 2.0))
        second = next(events)
        page.feed.show_team((), CoordinatorReport(stamp=5.0))
        assert next(events)["event"] == "team"
    assert [first["event"], second["event"]] == ["poses", "poses"]
    assert "id" not in first
    robots = [json.loads(event["data"])["robots"] for event in (first, second)]
    assert [robot["r1"]["pose"] for robot in robots] == [[1.0, 0.0, 0.0], [2.0, 0.0, 0.0]]
    assert page.ask("/api/poses").json == {"robots": robots[1]}


def test_paths_are_there_when_their_version_is_told(page: Page, lines: LineMap) -> None:
    with page.events() as events:
        versions = (event for event in events if event["event"] == "version")
        for version in range(1, 6):
            publish(page, lines, version, version)
            number = next(versions)["id"]
            assert page.ask(f"/api/joint/{number}/paths").json["kept"] is True


def test_who_had_the_version_before_is_told_what_changed_and_who_had_not_is_not(
    page: Page, lines: LineMap
) -> None:
    publish(page, lines, 1, 2)
    with page.events() as events, page.events({"Last-Event-ID": "1"}) as others:
        versions = (event for event in events if event["event"] == "version")
        assert "changes" not in json.loads(next(versions)["data"])  # it asks for all of it
        told = json.loads(next(e for e in others if e["event"] == "version")["data"])
        assert (told["version"], told["changes"]["components"][0]["was"]) == (2, 0)
        page.publish(make_joint(3, lines, a=0.0, b=3.0))
        told = json.loads(next(versions)["data"])
    (change,) = told["changes"]["components"]
    polylines = len(page.ask("/api/joint/2").json["components"][0]["polylines"])
    assert change["walls"] == [[0, polylines]]
    assert set(change["robots"]) == {"a/0", "b/0"}
    assert told["changes"]["paths"]["components"] == {}


def test_what_was_searched_is_told_after_the_version(page: Page, lines: LineMap) -> None:
    publish(page, lines, 1, 1)
    with page.events() as events:
        assert next(event for event in events if event["event"] == "version")["id"] == "1"
        publish(page, lines, 2, 2)
        told = list(islice((e for e in events if e["event"] in ("version", "searched")), 2))
    assert [event["event"] for event in told] == ["version", "searched"]
    assert "id" not in told[1]
    searched = json.loads(told[1]["data"])
    whole = page.ask("/api/joint/2").json
    assert searched["version"] == 2
    assert searched["components"] == [
        {name: component[name] for name in ("explored_m2", "frontiers")}
        for component in whole["components"]
    ]


def test_who_no_longer_listens_is_not_told() -> None:
    feed, heard = Feed(), []
    with feed.heard_by(lambda seen: heard.append(seen.version)):
        feed.show_version(1, ())
    feed.show_version(2, ())
    assert heard == [1]
    assert feed.seen.version == 2
