"""The story of a team: what is told, and the command that tells it."""

import json
import re
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import zenoh

from mapweave.maps import Alignment, Decision, JointMap, RobotMap
from mapweave.reasons import Reason, ReasonKind, Status, StatusKind
from mapweave_protocol.link.inbox import Arrival
from mapweave_protocol.link.session import (
    declare_joint_publisher,
    declare_map_publisher,
    open_session,
)
from mapweave_protocol.narration.story import Story
from mapweave_protocol.narration.watch import Watcher, watch
from mapweave_protocol.wire import keys
from mapweave_protocol.wire.codec import encode
from mapweave_protocol.wire.messages import (
    AlignmentMessage,
    JointMapMessage,
    JointStatusMessage,
    MapMessage,
    MapVersion,
    StatusMessage,
)

MakeMap = Callable[..., RobotMap]
MakeJoint = Callable[..., JointMap]
PATIENCE = 60.0  # [s] for a machine with much else to do
MAPWEAVE = Path(sys.executable).with_name("mapweave")


def decided(decision: Decision) -> AlignmentMessage:
    a, b = (MapVersion(robot=robot, boot="x", version=1) for robot in "ab")
    alignment = Alignment(
        "a/0", "b/0", np.zeros(3), decision, 0.5, Reason.words("look-alike corridors")
    )
    return AlignmentMessage.pack("a", a, b, [alignment])


def status(seen: int, *, finished: bool = False) -> StatusMessage:
    return StatusMessage(
        robot="a",
        boot="b1",
        stamp=0.0,
        state="finished" if finished else "mapping",
        scans_seen=seen,
        scans_placed=seen,
        components=1,
        submaps=1,
        map_version=1,
    )


def test_a_robot_that_comes_and_goes_is_told_once_each() -> None:
    story = Story()
    lines = [*story.appeared("a", "b1"), *story.appeared("a", "b1"), *story.left("a", "b1")]
    assert lines == ["a is here", "a is gone"]


def test_two_that_claim_one_id_are_told_and_that_one_is_left_is_not() -> None:
    story = Story()
    lines = [*story.appeared("a", "b1"), *story.appeared("a", "b2"), *story.left("a", "b1")]
    two = "2 agents call themselves a: expected one; give each robot an id of its own"
    assert lines == ["a is here", two]
    assert story.robots["a"].here


def test_a_second_coordinator_is_told_once() -> None:
    watcher = Watcher()
    tokens = [keys.COORDINATOR_LIVE.build(team="t", boot=boot) for boot in ("x", "y", "y")]
    lines = [line for key in tokens for line in watcher.tell(Arrival(key, b""))]
    two = "2 coordinators of the team are here, each with its own joint map: expected one"
    assert lines == ["the coordinator is here", two]


def test_a_decision_is_told_when_it_is_new_with_confidence_and_reason() -> None:
    story = Story()
    decisions: list[Decision] = ["ambiguous", "ambiguous", "accepted"]
    lines = [line for decision in decisions for line in story.aligned(decided(decision))]
    assert lines == [
        "a/0 and b/0: ambiguous, confidence 50% (look-alike corridors)",
        "a/0 and b/0: now accepted, confidence 50% (look-alike corridors)",
    ]


def test_the_end_of_mapping_is_told_once() -> None:
    story = Story()
    lines = [
        *story.status(status(5)),
        *story.status(status(9, finished=True)),
        *story.status(status(9, finished=True)),
    ]
    assert lines == ["a has finished: 9 scans, 9 placed"]


def test_a_status_of_before_or_of_another_run_has_no_end_told_twice() -> None:
    story, another = Story(), status(7).model_copy(update={"boot": "b0"})
    done = status(9, finished=True)
    said = (done, another, done, status(8), done)
    assert [line for message in said for line in story.status(message)] == [
        "a has finished: 9 scans, 9 placed"
    ]


def test_a_version_of_the_joint_map_is_told_once_with_its_components(
    random_joint: MakeJoint,
) -> None:
    watcher = Watcher()
    payload = encode(JointMapMessage.pack(random_joint(1, 4), "s1"))
    arrival = Arrival(keys.JOINT_MAP.build(team="t"), payload)
    lines = list(watcher.tell(arrival))
    assert lines[0].startswith("joint map 4: a/0 + b/0 (")
    assert list(watcher.tell(arrival)) == []


def test_a_join_that_a_version_does_not_rely_on_is_told_once_with_the_reason() -> None:
    story = Story()
    found = Reason.words("40 m in common")
    off = Reason(ReasonKind.OTHERS_CONTRADICT, {"distance": 9.0, "turn": 0.0}, found)
    little = Reason(ReasonKind.LITTLE_COMMON, {"common": 2.0})
    plain = Alignment("a/0", "b/0", np.zeros(3), "ambiguous", 0.9, off)
    aside = replace(plain, status=Status(StatusKind.SET_ASIDE, (("a/0", "c/0"),)))
    revoked = replace(plain, cause=little, status=Status(StatusKind.REVOKED, revoked_in=3))
    lines = [
        line
        for version, alignment in enumerate([aside, aside, revoked, revoked], start=1)
        for line in story.joined(JointMap(version, (), (alignment,)))
        if not line.startswith("joint map")
    ]
    assert lines == [
        "a/0 and b/0: alignment not relied on (9.0 m and 0° off what a/0-c/0 says; 40 m in common)",
        "a/0 and b/0: alignment revoked in version 3 (only 2.0 m of wall in common)",
    ]


def test_a_version_that_only_the_coordinator_speaks_of_is_lacking_until_it_is_told(
    random_joint: MakeJoint,
) -> None:
    watcher = Watcher()
    said = JointStatusMessage(boot="c1", stamp=0.0, series="s1", version=4, pending=False)
    list(watcher.tell(Arrival(keys.JOINT_STATUS.build(team="t"), encode(said))))
    assert watcher.lacks_version
    list(watcher.tell_joint(JointMapMessage.pack(random_joint(1, 4), "s1")))
    assert not watcher.lacks_version
    list(watcher.tell(Arrival(keys.JOINT_STATUS.build(team="t"), encode(said))))
    assert not watcher.lacks_version


def test_what_is_no_message_is_not_told() -> None:
    watcher = Watcher()
    for key in (
        keys.MAP.build(team="t", robot="a"),
        "mapweave/v2/t/live/agent/NO ID/1",
        "mapweave/v2/t/live/coordinator/NO ID",
        "elsewhere",
    ):
        assert list(watcher.tell(Arrival(key, b"junk"))) == []


@pytest.mark.parametrize("form", [(), ("--json",)])
def test_the_command_tells_what_happens_line_by_line(
    endpoint: str,
    team: str,
    random_map: MakeMap,
    random_joint: MakeJoint,
    form: tuple[str, ...],
) -> None:
    command = [str(MAPWEAVE), "watch", "--team", team, "--connect", endpoint, *form]
    with (
        open_session([endpoint], patience=20.0) as session,
        declare_map_publisher(session, keys.MAP.build(team=team, robot="a")) as maps,
        declare_joint_publisher(session, keys.JOINT_MAP.build(team=team)) as joints,
        session.liveliness().declare_token(keys.LIVE.build(team=team, robot="a", boot="b1")),
    ):
        maps.put(encode(MapMessage.pack(random_map(1, 2))))
        joint = replace(random_joint(1, 4), alignments=())
        nothing_free = [replace(c, map=replace(c.map, free_space=())) for c in joint.components]
        joint = replace(joint, components=tuple(nothing_free))
        joints.put(encode(JointMapMessage.pack(joint, "s1")))
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as watching:
            assert watching.stdout is not None
            never = threading.Timer(PATIENCE, watching.kill)
            never.start()
            lines = [watching.stdout.readline() for _ in range(3)]
            never.cancel()
            watching.send_signal(signal.SIGTERM)
    if form:
        told = [json.loads(line)["line"] for line in lines]
        assert all(0 <= time.time() - json.loads(line)["time"] < 2 * PATIENCE for line in lines)
    else:
        assert all(re.match(r"\d\d:\d\d:\d\d ", line) for line in lines)
        told = [line.partition(" ")[2] for line in lines]
    words = sorted(line.split()[:3] for line in told)
    assert words == [["before:", "a", "is"], ["before:", "a:", "2"], ["before:", "joint", "map"]]


def test_an_answer_that_is_no_joint_map_is_ignored(
    endpoint: str, team: str, caplog: pytest.LogCaptureFixture
) -> None:
    key = keys.JOINT_QUERY.build(team=team)

    def answer(query: zenoh.Query) -> None:
        with query:
            query.reply(key, b"junk")

    with open_session([endpoint]) as session, session.declare_queryable(key, answer):
        story = watch(team, [endpoint], Watcher(), lambda _: None)
        assert next(iter(story)) is None
    assert "answer ignored" in caplog.text
