"""What arrives is read if it is valid and from the robot that its key names; else counted."""

import numpy as np
import pytest

from mapweave.maps import Alignment, RobotMap
from mapweave.reasons import Reason, ReasonKind
from mapweave_protocol.link.inbox import (
    Arrival,
    Presence,
    alignment_reader,
    map_reader,
    read_presence,
)
from mapweave_protocol.wire import keys
from mapweave_protocol.wire.codec import encode
from mapweave_protocol.wire.messages import AlignmentMessage, MapMessage, MapVersion

PAYLOAD = encode(MapMessage.pack(RobotMap("a", "x", 1, ())))


def at(robot: str, payload: bytes = PAYLOAD, *, gone: bool = False) -> Arrival:
    return Arrival(keys.MAP.build(team="t", robot=robot), payload, gone)


def test_a_map_is_read_under_the_key_of_its_robot_only() -> None:
    reader = map_reader()
    message = reader.read(at("a"))
    assert message is not None and message.robot == "a"
    assert reader.read(at("b")) is None
    assert reader.refused == 1


@pytest.mark.parametrize("ends", [("a", "c"), ("c", "b"), ("b", "a")])
def test_an_alignment_is_read_under_the_key_of_its_pair_only(ends: tuple[str, str]) -> None:
    versions = [MapVersion(robot=robot, boot="x", version=1) for robot in "ab"]
    found = Alignment("a/0", "b/0", np.zeros(3), "refused", 0.1, Reason(ReasonKind.NO_SHAPE))
    payload = encode(AlignmentMessage.pack("a", versions[0], versions[1], [found]))
    right, wrong = (
        Arrival(keys.ALIGNMENT.build(team="t", robot="a", reference=r, other=o), payload)
        for r, o in (("a", "b"), ends)
    )
    reader = alignment_reader()
    assert reader.read(right) is not None
    assert reader.read(wrong) is None


def test_what_is_no_message_is_refused_and_counted() -> None:
    reader = map_reader()
    assert [reader.read(at("a", payload)) for payload in (b"", b"nonsense", PAYLOAD[:-1])] == [
        None
    ] * 3
    assert reader.refused == 3


def test_a_reader_reads_its_own_keys_as_long_as_something_is_there() -> None:
    reader = map_reader()
    assert reader.reads(at("a"))
    assert not reader.reads(at("a", gone=True))
    assert not reader.reads(Arrival(keys.STATUS.build(team="t", robot="a"), PAYLOAD))


@pytest.mark.parametrize("gone", [False, True])
def test_a_token_says_which_run_is_here_or_no_longer(gone: bool) -> None:
    token = Arrival(keys.LIVE.build(team="t", robot="a", boot="x"), b"", gone)
    assert read_presence(token) == Presence("a", "x", here=not gone)
    assert read_presence(at("a")) is None
