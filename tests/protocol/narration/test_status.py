"""One table tells who is here, how far each is, and what was refused."""

import json
import subprocess
import sys
import threading
from pathlib import Path

from rich.console import Console

from mapweave_protocol.link.session import open_session
from mapweave_protocol.narration.status import COLUMNS, LISTENED, Team, as_json, listen, table_of
from mapweave_protocol.wire import keys
from mapweave_protocol.wire.codec import encode
from mapweave_protocol.wire.messages import (
    JointStatusMessage,
    MapVersion,
    StatusMessage,
)

MAPWEAVE = Path(sys.executable).with_name("mapweave")


def _status(robot: str, version: int, **more: object) -> StatusMessage:
    counts = dict.fromkeys(("scans_seen", "scans_placed", "components", "submaps"), 5)
    fields = {"robot": robot, "boot": "b1", "stamp": 0.0, "state": "mapping"}
    return StatusMessage.model_validate({**counts, **fields, "map_version": version, **more})


def _coordinator(**more: object) -> JointStatusMessage:
    fields = {"boot": "c1", "stamp": 0.0, "series": "s", "version": 12, "pending": False}
    return JointStatusMessage.model_validate({**fields, **more})


def _lines(team: Team) -> list[list[str]]:
    console = Console(width=200)
    with console.capture() as said:
        console.print(table_of(team))
    return [line.split() for line in said.get().splitlines()]


def test_a_row_tells_how_far_the_coordinator_is_behind_and_what_was_refused() -> None:
    held = MapVersion(robot="r1", boot="b1", version=7)
    team = Team(
        here={"r1", "r3"},
        statuses={"r1": _status("r1", 9, refused={"r2 map": 4}), "r2": _status("r2", 3)},
        coordinators={"c1"},
        coordinator=_coordinator(maps=(held,), refused={"r9 pose": 1}, stored=False),
    )
    _, coordinator, r1, r2, r3 = _lines(team)
    assert coordinator[:5] == ["coordinator", "yes", "up", "to", "date,"]
    assert "not storing" in " ".join(coordinator)
    assert "1 r9 pose" in " ".join(coordinator)
    assert r1[:3] == ["r1", "yes", "mapping"]
    assert " 9 " in f" {' '.join(r1)} " and "4 r2 map" in " ".join(r1)
    assert team.behind("r1") == 2
    assert team.behind("r2") == 3
    assert r2[:2] == ["r2", "no"]
    assert r3 == ["r3", "yes", "says", "nothing"]


def test_a_robot_that_is_gone_is_told_of_as_long_as_the_coordinator_holds_a_map_of_it() -> None:
    held = [MapVersion(robot="r4", boot=boot, version=k) for boot, k in (("b1", 7), ("b2", 9))]
    team = Team(here={"r1"}, coordinators={"c1"}, coordinator=_coordinator(maps=tuple(held)))
    *_, r1, r4 = _lines(team)
    assert r1 == ["r1", "yes", "says", "nothing"]
    assert r4 == ["r4", "no", "gone", "7,", "9"]


def test_each_column_of_figures_is_explained_where_the_command_is() -> None:
    words = [str(MAPWEAVE), "status", "--help"]
    told = " ".join(
        subprocess.run(words, capture_output=True, text=True, check=True).stdout.split()
    )
    figures = [column for column in COLUMNS if " " in column]
    assert figures
    assert [column for column in figures if f"{column}: " not in told] == []


def test_two_coordinators_and_none_are_told() -> None:
    assert _lines(Team(coordinators={"a", "b"}))[1][1:4] == ["2", "of", "them"]
    assert _lines(Team())[1][1:] == ["no", "says", "nothing"]


def test_a_digest_of_orders_is_told_to_programs_in_hexadecimal_digits() -> None:
    digest = bytes(range(0x98, 0xA0))
    statuses = {"r1": _status("r1", 3, orders=digest)}
    told = json.loads(as_json(Team(statuses=statuses, coordinator=_coordinator(orders=digest))))
    assert told["coordinator"]["orders"] == told["robots"]["r1"]["orders"] == digest.hex()


def test_the_command_tells_what_a_team_says(endpoint: str, team: str) -> None:
    words = [str(MAPWEAVE), "status", "--team", team, "--connect", endpoint]
    with (
        open_session([endpoint], patience=20.0) as session,
        session.liveliness().declare_token(keys.LIVE.build(team=team, robot="r1", boot="b1")),
    ):
        alone = subprocess.run([*words, "--json"], capture_output=True, text=True, check=False)
        assert alone.returncode == 1, "no coordinator is here"
        assert json.loads(alone.stdout)["here"] == ["r1"]
        coordinator = keys.COORDINATOR_LIVE.build(team=team, boot="c1")
        with session.liveliness().declare_token(coordinator):
            done = subprocess.run(words, capture_output=True, text=True, check=False)
            assert done.returncode == 0
            assert len(done.stdout.splitlines()) == 3


def test_what_is_said_meanwhile_is_heard_and_nonsense_is_not(endpoint: str, team: str) -> None:
    with open_session([endpoint], patience=20.0) as session:
        over = threading.Event()

        def say() -> None:
            while not over.wait(0.1):
                key = keys.STATUS.build(team=team, robot="r1")
                session.put(key, b"nonsense")
                session.put(key, encode(_status("r1", 4)))
                session.put(keys.JOINT_STATUS.build(team=team), encode(_coordinator()))

        saying = threading.Thread(target=say)
        saying.start()
        try:
            heard = listen(session, team, LISTENED)
        finally:
            over.set()
            saying.join()
    assert heard.statuses["r1"].map_version == 4
    assert heard.coordinator is not None and heard.coordinator.version == 12
