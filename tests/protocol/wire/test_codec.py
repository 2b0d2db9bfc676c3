import zlib
from collections.abc import Callable
from dataclasses import replace

import msgpack
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from mapweave.evidence import Evidence, RunnerUp
from mapweave.maps import Alignment, JointMap, LineMap, RobotMap, Submap, Trajectory
from mapweave.reasons import Reason, ReasonKind
from mapweave_protocol.errors import MessageError
from mapweave_protocol.link.assembler import MapAssembler
from mapweave_protocol.wire import alignment_message
from mapweave_protocol.wire.codec import DEFLATED, PLAIN, decode, encode
from mapweave_protocol.wire.coding.extensions import extended
from mapweave_protocol.wire.joint_status_message import Place
from mapweave_protocol.wire.messages import (
    AlignmentMessage,
    Compared,
    JointMapMessage,
    JointStatusMessage,
    MapMessage,
    MapVersion,
    PoseMessage,
    StatusMessage,
    Traffic,
)
from mapweave_protocol.wire.model import Message
from mapweave_protocol.wire.pose_message import JointPose
from tests.alignment_strategies import alignments as some_alignments

MakeMap = Callable[..., RobotMap]
MakeJoint = Callable[..., JointMap]
SEEDS = st.integers(0, 2**32 - 1)
ALIGNMENT = Alignment(
    "a/0",
    "b/12",
    np.array([1.25, -3.0, 0.1]),
    "refused",
    0.125,
    Reason(ReasonKind.LITTLE_COMMON, {"common": 1.5}),
    Evidence(common=1.5),
    RunnerUp(np.array([0.0, 1.0, 2.0]), evidence=Evidence(common=0.5)),
)


def complete_map(robot_map: RobotMap) -> RobotMap:
    message = decode(MapMessage, encode(MapMessage.pack(robot_map)))
    arrived = MapAssembler().update(message)
    assert arrived is not None
    return arrived


def status() -> StatusMessage:
    compared = {"b": Compared(own_version=3, peer_boot="x", peer_version=7)}
    return StatusMessage(
        robot="a",
        boot="b1",
        stamp=1.7e9,
        state="mapping",
        scans_seen=9,
        scans_placed=8,
        components=1,
        submaps=2,
        map_version=3,
        compared=compared,
        holds=(MapVersion(robot="b", boot="x", version=7),),
        sent={"map": Traffic(messages=2, bytes=999)},
    )


def joint_status() -> JointStatusMessage:
    a, b = (MapVersion(robot=robot, boot="x", version=3) for robot in "ab")
    return JointStatusMessage(
        boot="c", stamp=1.7e9, series="s1", version=2, pending=True, maps=(a, b),
        alignments=((a, b),), frames={"b/0": Place(frame="a/0", pose=(1.0, 2.0, 3.0))},
    )  # fmt: skip


def pose() -> PoseMessage:
    covariance = tuple(float(n) for n in range(6))
    joint = JointPose(frame="a/0", since=3, pose=(4.0, 5.0, 6.0))
    return PoseMessage(
        robot="b", boot="b1", stamp=1.7e9, sent=1.7e9, scan_index=7, found=True, component="b/1",
        pose=(1.0, 2.0, 3.0), covariance=covariance, joint=joint,
    )  # fmt: skip


def alignments(*found: Alignment) -> AlignmentMessage:
    versions = [MapVersion(robot=robot, boot="x", version=3) for robot in "ab"]
    return AlignmentMessage.pack("a", versions[0], versions[1], found or [ALIGNMENT])


def messages(make_map: MakeMap, make_joint: MakeJoint) -> list[Message]:
    joint = JointMapMessage.pack(make_joint(3), series="s1")
    return [MapMessage.pack(make_map(1)), joint, status(), joint_status(), alignments(), pose()]


@pytest.mark.parametrize("angle", [np.pi, -np.pi, 3.1415955, -3.1415955, 7.0, 0.0])
def test_any_angle_stays_within_half_a_turn_and_keeps_its_bytes(angle: float) -> None:
    submap = Submap(0, 0, np.array([0, 0, angle]), LineMap.empty(), Trajectory.empty())
    once = complete_map(RobotMap("a", "b1", 1, (submap,)))
    assert -np.pi < once.submaps[0].pose[2] <= np.pi
    assert np.array_equal(complete_map(once).submaps[0].pose, once.submaps[0].pose)


@pytest.mark.parametrize("stamp", [np.nan, np.inf, 1e300])
def test_a_stamp_that_says_nothing_arrives_as_unknown(stamp: float) -> None:
    trajectory = Trajectory(np.array([7]), np.array([stamp]), np.zeros((1, 3)))
    submap = Submap(0, 0, np.zeros(3), LineMap.empty(), trajectory)
    arrived = complete_map(RobotMap("a", "b1", 1, (submap,)))
    assert np.isnan(arrived.submaps[0].trajectory.stamp[0])


def test_a_joint_map_arrives_with_its_alignments(random_joint: MakeJoint) -> None:
    sent = random_joint(5, version=4)
    arrived = decode(JointMapMessage, encode(JointMapMessage.pack(sent, series="s1"))).unpack()
    assert arrived.version == 4
    (before,), (after,) = sent.components, arrived.components
    assert before.robots.keys() == after.robots.keys()
    assert before.map.segments.shape == after.map.segments.shape
    assert np.allclose(
        np.sort(before.segment_confidence), np.sort(after.segment_confidence), atol=0.0101
    )
    assert_same_alignment(arrived.alignments[0], sent.alignments[0])


def assert_same_alignment(found: Alignment, expected: Alignment) -> None:
    """Assert that they are the same to the digits that travel."""
    assert np.allclose(found.transform, expected.transform, rtol=0, atol=6e-5)
    for name in ("reference", "other", "decision", "status"):
        assert getattr(found, name) == getattr(expected, name)
    assert found.confidence == pytest.approx(expected.confidence, rel=1e-3)
    assert found.cause.kind == expected.cause.kind
    assert found.cause.numbers == pytest.approx(dict(expected.cause.numbers), rel=1e-3)
    assert found.evidence.by_name() == pytest.approx(expected.evidence.by_name(), rel=1e-3)
    assert (found.runner_up is None) == (expected.runner_up is None)
    if found.runner_up is not None and expected.runner_up is not None:
        assert np.allclose(found.runner_up.transform, expected.runner_up.transform, atol=6e-5)
        numbers = expected.runner_up.by_name()
        assert found.runner_up.by_name() == pytest.approx(numbers, rel=1e-3)


@given(some_alignments())
@settings(deadline=None)
def test_an_alignment_arrives_as_it_was_sent(sent: Alignment) -> None:
    (arrived,) = decode(AlignmentMessage, encode(alignments(sent))).unpack()
    assert_same_alignment(arrived, sent)


@pytest.mark.parametrize(
    ("field", "value", "match"),
    [
        ("cause", {"kind": "rival", "numbers": {"common": 1.0}}, "reason rival: expected"),
        ("cause", {"kind": "gossip", "numbers": {}}, "cause.kind"),
        ("cause", {"kind": "words", "numbers": {}, "text": "\x1b[2J"}, "printable"),
        ("status", "revoked", "expected a version"),
        ("status", "lost", "status"),
        ("set_aside_by", (("a/0", "B"),), "set_aside_by"),
        ("revoked_in", -1, "revoked_in"),
    ],
)
def test_a_cause_or_status_that_makes_no_sense_is_refused(
    field: str, value: object, match: str
) -> None:
    fields = alignments().model_dump()
    fields["alignments"][0][field] = value
    with pytest.raises(MessageError, match=match):
        decode(AlignmentMessage, envelope(alignments(), msgpack.packb(fields)))


def test_reasons_about_reasons_without_end_are_refused() -> None:
    cause: dict[str, object] = {"kind": "no_shape", "numbers": {}}
    for _ in range(200):
        cause = {"kind": "met_before", "numbers": {}, "found": cause}
    fields = alignments().model_dump()
    fields["alignments"][0]["cause"] = cause
    with pytest.raises(MessageError):
        decode(AlignmentMessage, envelope(alignments(), msgpack.packb(fields)))


def test_what_could_not_be_measured_is_left_out() -> None:
    numbers = Evidence(common=2.0, residual=np.inf, overlap=np.nan)
    rival = RunnerUp(np.zeros(3), np.nan, evidence=numbers)
    poor = replace(ALIGNMENT, evidence=numbers, runner_up=rival)
    versions = [MapVersion(robot=robot, boot="x", version=3) for robot in "ab"]
    sent = AlignmentMessage.pack("a", versions[0], versions[1], [poor])
    (arrived,) = decode(AlignmentMessage, encode(sent)).unpack()
    assert arrived.evidence == Evidence(common=2.0)
    assert arrived.runner_up is not None
    assert arrived.runner_up.by_name() == {"common": 2.0}


def test_a_status_arrives_as_it_was_sent() -> None:
    assert decode(StatusMessage, encode(status())) == status()
    assert decode(JointStatusMessage, encode(joint_status())) == joint_status()


def test_what_is_known_by_its_place_travels_without_its_name_and_all_else_with_it() -> None:
    [travels] = alignments().alignments
    assert travels.values()[5] == extended((1.5,))  # first in evidence: common
    strange = travels.model_copy(update={"evidence": {"common": 1.5, "strange": 2.0}})
    message = alignments().model_copy(update={"alignments": (strange,)})
    assert decode(AlignmentMessage, encode(message)) == message
    sent = {"pose": Traffic(messages=1, bytes=2), "map": Traffic(messages=3, bytes=4)}
    counted = status().model_copy(update={"sent": sent})
    assert decode(StatusMessage, encode(counted)) == counted


@pytest.mark.parametrize("boot", ["00a1ff09", "deadbeef", "12345678"])
def test_a_run_named_by_eight_digits_takes_less_than_its_name(boot: str) -> None:
    named = status().model_copy(update={"boot": boot})
    assert decode(StatusMessage, encode(named)) == named
    other = named.model_copy(update={"boot": f"{boot[:7]}z"})
    assert decode(StatusMessage, encode(other)) == other
    assert len(encode(named)) < len(encode(other))


def test_a_segment_costs_few_bytes(random_map: MakeMap) -> None:
    """A list of floats would take 36 bytes of msgpack for each segment alone."""
    robot_map = random_map(7, 40)
    numbers = sum(submap.map.segments.size for submap in robot_map.submaps)
    numbers += sum(ring.size for s in robot_map.submaps for ring in s.map.free_space)
    numbers += sum(submap.trajectory.pose.size * 5 // 3 for submap in robot_map.submaps)
    overhead = 250 * len(robot_map.submaps)
    assert len(encode(MapMessage.pack(robot_map))) < 2.5 * numbers + overhead


def accepts_or_refuses(kind: type[Message], payload: bytes) -> None:
    """Decode `payload`: whatever is not a `MessageError` fails the test."""
    try:
        message = decode(kind, payload)
    except MessageError:
        return
    assert isinstance(message, kind)


@given(st.binary(max_size=300))
def test_random_bytes_are_refused(payload: bytes) -> None:
    for kind in (
        MapMessage, JointMapMessage, StatusMessage, JointStatusMessage, AlignmentMessage,
    ):  # fmt: skip
        with pytest.raises(MessageError):
            decode(kind, payload)


@given(st.data())
@settings(max_examples=300, deadline=None)
def test_a_damaged_message_is_refused_or_valid(
    random_map: MakeMap, random_joint: MakeJoint, data: st.DataObject
) -> None:
    """Bytes of the envelope, or of the body before compression, are replaced or cut off."""
    message = data.draw(st.sampled_from(messages(random_map, random_joint)))
    body = bytearray(msgpack.packb(message.values()))
    for _ in range(data.draw(st.integers(1, 3))):
        body[data.draw(st.integers(0, len(body) - 1))] = data.draw(st.integers(0, 255))
    cut = bytes(body[: data.draw(st.integers(0, len(body)))])
    for damaged in (bytes(body), cut):
        accepts_or_refuses(type(message), envelope(message, damaged))
    payload = encode(message)
    accepts_or_refuses(type(message), payload[: data.draw(st.integers(0, len(payload)))])


HOSTILE = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-(2**63), 2**64 - 1)
    | st.floats()
    | st.text(max_size=9)
    | st.binary(max_size=40),
    lambda inner: (
        st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=9), inner, max_size=4)
    ),
    max_leaves=8,
)


@given(st.data())
@settings(max_examples=300, deadline=None)
def test_a_message_with_another_value_in_a_field_is_refused_or_valid(
    random_map: MakeMap, random_joint: MakeJoint, data: st.DataObject
) -> None:
    message = data.draw(st.sampled_from(messages(random_map, random_joint)))
    fields = message.model_dump()
    place = fields
    while True:
        name = data.draw(st.sampled_from(sorted(place)))
        inner = place[name][0] if isinstance(place[name], tuple) and place[name] else place[name]
        if not isinstance(inner, dict) or not inner or data.draw(st.booleans()):
            break
        place = inner
    place[name] = data.draw(HOSTILE)
    accepts_or_refuses(type(message), envelope(message, msgpack.packb(fields)))


def envelope(message: Message, body: bytes) -> bytes:
    return encode(message)[:4] + PLAIN + body


def test_a_bomb_is_refused_before_it_unfolds() -> None:
    bomb = zlib.compress(bytes(MapMessage.budget.body + 1))
    payload = encode(status())[:3] + MapMessage.letter + DEFLATED + bomb
    with pytest.raises(MessageError, match="decompressed"):
        decode(MapMessage, payload)


@pytest.mark.parametrize(
    "start", [b"\xdd\xff\xff\xff\xff", b"\xdf\xff\xff\xff\xff", b"\x91" * 9999]
)
def test_a_promise_of_more_than_there_is_is_refused(start: bytes) -> None:
    with pytest.raises(MessageError):
        decode(StatusMessage, start)
    with pytest.raises(MessageError):
        decode(StatusMessage, envelope(status(), start))


def test_another_version_of_the_wire_is_named_in_the_refusal() -> None:
    payload = bytearray(encode(status()))
    payload[2] = 9
    with pytest.raises(MessageError, match="version 9 of the wire, expected 3"):
        decode(StatusMessage, bytes(payload))


def test_a_message_of_an_earlier_program_is_named_in_the_refusal() -> None:
    payload = msgpack.packb({"format": "mapweave/map-message/1", "deflated": False, "body": b""})
    with pytest.raises(MessageError, match="earlier version of the wire"):
        decode(MapMessage, payload)


def test_a_message_of_another_kind_is_named_in_the_refusal() -> None:
    with pytest.raises(MessageError, match="found kind b's', expected 'm'"):
        decode(MapMessage, encode(status()))


def test_a_status_of_a_robot_that_knows_nobody_is_short() -> None:
    alone = status().model_copy(update={"compared": {}, "holds": (), "sent": {}})
    assert len(encode(alone)) < 40


@pytest.mark.parametrize("number", [np.nan, np.inf, 1e9])
def test_coordinates_that_are_nowhere_are_not_sent(random_map: MakeMap, number: float) -> None:
    robot_map = random_map(1)
    pose = np.array([number, 0.0, 0.0])
    lost = Submap(0, 0, pose, LineMap.empty(), Trajectory.empty())
    with pytest.raises(ValueError, match="expected finite"):
        MapMessage.pack(RobotMap(robot_map.robot, "b1", 1, (lost,)))


def test_an_alignment_of_another_pair_is_refused() -> None:
    versions = [MapVersion(robot=robot, boot="x", version=3) for robot in "ac"]
    with pytest.raises(ValueError, match="another pair"):
        AlignmentMessage.pack("a", versions[0], versions[1], [ALIGNMENT])


@pytest.mark.parametrize("transform", [(1e9, 0.0, 0.0), (0.0, -1.1e5, 0.0), (0.0, 0.0, 7.0)])
def test_an_alignment_to_nowhere_is_refused(transform: tuple[float, float, float]) -> None:
    fields = alignments().model_dump()
    fields["alignments"][0]["transform"] = transform
    with pytest.raises(MessageError, match="transform"):
        decode(AlignmentMessage, envelope(alignments(), msgpack.packb(fields)))


def test_a_reason_that_would_move_the_cursor_is_refused() -> None:
    fields = alignments().model_dump()
    fields["alignments"][0]["cause"] = {"kind": "words", "numbers": {}, "text": "\x1b[2J"}
    with pytest.raises(MessageError, match="printable"):
        decode(AlignmentMessage, envelope(alignments(), msgpack.packb(fields)))


@pytest.mark.parametrize("version", [True, 1.0, -1, "1"])
def test_a_state_told_before_lets_nothing_pass_that_only_equals_it(version: object) -> None:
    told = ("r1", "boot", 1)
    assert MapVersion.model_validate(told) is MapVersion.model_validate(told)
    with pytest.raises(ValidationError):
        MapVersion.model_validate(("r1", "boot", version))


def test_of_states_told_no_more_are_remembered_than_so_many() -> None:
    for version in range(2 * alignment_message.REMEMBERED):
        assert MapVersion.model_validate(("r1", "boot", version)).version == version
        assert len(alignment_message._told) <= alignment_message.REMEMBERED
