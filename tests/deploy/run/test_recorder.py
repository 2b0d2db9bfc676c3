"""What the launcher makes of a team's messages."""

import pytest

from mapweave_deploy.run.recorder import Recorder, is_done, to_come
from mapweave_protocol.link.inbox import Arrival
from mapweave_protocol.wire.codec import encode
from mapweave_protocol.wire.keys import JOINT_MAP, STATUS
from mapweave_protocol.wire.messages import (
    Compared,
    JointStatusMessage,
    MapVersion,
    StatusMessage,
)


def status(
    robot: str, version: int = 3, compared: dict[str, int] | None = None, **changes: object
) -> StatusMessage:
    """Return a finished robot's status; `compared` gives the peers' versions."""
    peers = {
        peer: Compared(own_version=version, peer_boot=f"boot-{peer}", peer_version=of_peer)
        for peer, of_peer in (compared or {}).items()
    }
    fields = {
        "robot": robot, "boot": f"boot-{robot}", "stamp": 0.0, "state": "finished",
        "scans_seen": 9, "scans_placed": 9, "components": 1, "submaps": 1,
        "map_version": version, "compared": peers,
    }  # fmt: skip
    return StatusMessage.model_validate(fields | changes)


def done(*statuses: StatusMessage) -> bool:
    """Return whether robots a, b and c are done with these statuses."""
    return is_done(["a", "b", "c"], {message.robot: message for message in statuses})


def test_a_team_is_done_when_one_of_each_pair_compared_both_last_maps() -> None:
    assert done(status("a", compared={"b": 3, "c": 3}), status("b"), status("c", compared={"b": 3}))


def test_a_team_is_not_done_while_a_pair_was_not_compared() -> None:
    assert not done(status("a", compared={"b": 3, "c": 3}), status("b"), status("c"))


def test_a_team_is_not_done_when_a_pair_was_compared_before_the_last_version() -> None:
    outdated = status("a", compared={"b": 2, "c": 3})
    assert not done(outdated, status("b"), status("c", compared={"b": 3}))


def test_a_team_is_not_done_when_a_pair_was_compared_in_another_run() -> None:
    another_run = status("b", boot="later")
    assert not done(
        status(
            "a",
            compared={
                "b": 3,
                "c": 3,
            },
        ),
        another_run,
        status("c", compared={"b": 3}),
    )


@pytest.mark.parametrize("who", ["a", "b", "c"])
def test_a_team_is_not_done_while_a_robot_maps_or_is_unheard(who: str) -> None:
    statuses = {name: status(name, compared=dict.fromkeys("abc", 3)) for name in "abc"}
    assert is_done(["a", "b", "c"], statuses)
    assert not is_done(["a", "b", "c"], {k: v for k, v in statuses.items() if k != who})
    statuses[who] = status(who, state="mapping", compared=dict.fromkeys("abc", 3))
    assert not is_done(["a", "b", "c"], statuses)


def coordinator(*, pending: bool = False, **versions: int) -> JointStatusMessage:
    """Return what a coordinator says that holds these versions of robots' maps."""
    held = tuple(
        MapVersion(robot=robot, boot=f"boot-{robot}", version=version)
        for robot, version in versions.items()
    )
    return JointStatusMessage(
        boot="boot", stamp=0.0, series="series", version=1, pending=pending, maps=held
    )


def test_a_team_waits_until_its_coordinator_has_all_last_maps_and_made_one_of_them() -> None:
    robots = {name: status(name) for name in "ab"}

    def left(*said: JointStatusMessage) -> list[str]:
        return to_come("ab", robots, said)

    assert left() == ["map of a", "map of b"]
    assert left(coordinator(a=3, b=2)) == ["map of b"]
    assert left(coordinator(a=3, b=3, pending=True)) == ["the last joint map"]
    assert left(coordinator(a=3, b=3)) == []


def test_a_robot_without_a_map_is_not_waited_for() -> None:
    nowhere = status("a", submaps=0, map_version=0)
    assert to_come("a", {"a": nowhere}, [coordinator()]) == []
    assert to_come("a", {"a": nowhere}, []) == ["the last joint map"]


def test_messages_and_bytes_are_counted_by_robot_and_kind() -> None:
    recorder = Recorder()
    payload = encode(status("r1"))
    key = STATUS.build(team="t", robot="r1")
    lines = [line for _ in range(2) for line in recorder.take(Arrival(key, payload))]
    list(recorder.take(Arrival(JOINT_MAP.build(team="t"), b"of nobody")))
    assert recorder.sent("r1")["status"].messages == 2
    assert recorder.sent("r1")["status"].size == 2 * len(payload)
    assert recorder.sent("r1")["map"].size == 0
    assert recorder.statuses["r1"].scans_placed == 9
    assert lines == ["r1 has finished: 9 scans, 9 placed"]


@pytest.mark.parametrize("end", ["R1/map", "R1/status", "r1/alignment/R1/r2"])
def test_a_key_with_an_invalid_id_is_of_no_robot(end: str) -> None:
    recorder = Recorder()
    assert list(recorder.take(Arrival(f"mapweave/v2/t/agent/{end}", b"junk"))) == []
    assert not recorder.traffic
