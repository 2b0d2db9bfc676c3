"""Versions of the joint map travel as what changed, and arrive whole."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapweave.maps import JointComponent, JointMap
from mapweave_protocol.errors import MessageError
from mapweave_protocol.link.joint_changes import (
    VERSIONS_TO_COMPLETE,
    JointAssembler,
    JointSender,
)
from mapweave_protocol.link.sequence import JointSequence
from mapweave_protocol.wire.codec import decode, encode
from mapweave_protocol.wire.messages import JointMapMessage

MakeJoint = Callable[..., JointMap]


def grow(random_joint: MakeJoint, rng: np.random.Generator, versions: int) -> list[JointMapMessage]:
    """Return versions of a joint map: some walls go, some come, an alignment changes or goes."""
    joint = random_joint(int(rng.integers(2**31)), version=1)
    found = [JointMapMessage.pack(joint, "s1")]
    for version in range(2, versions + 1):
        other = random_joint(int(rng.integers(2**31)), version=version)
        components = tuple(_changed(c, rng) for c in joint.components)
        alignments = other.alignments if rng.random() < 0.3 else joint.alignments
        alignments = alignments if rng.random() < 0.8 else ()
        joint = replace(joint, version=version, components=components, alignments=alignments)
        found.append(JointMapMessage.pack(joint, "s1"))
    return found


def _changed(component: JointComponent, rng: np.random.Generator) -> JointComponent:
    lines = component.map
    kept = rng.random(len(lines.segments)) < 0.8
    moved = replace(
        lines,
        segments=lines.segments[kept] + (rng.random((kept.sum(), 1)) < 0.2),
        polyline=np.unique(lines.polyline[kept], return_inverse=True)[1],
        support=lines.support[kept],
    )
    return replace(component, map=moved, segment_confidence=component.segment_confidence[kept])


def content(message: JointMapMessage) -> list[object]:
    joint = message.unpack()
    walls = [
        sorted(
            (*segment, support, round(sure, 6))
            for segment, support, sure in zip(
                component.map.segments.tolist(),
                component.map.support.tolist(),
                component.segment_confidence.tolist(),
                strict=True,
            )
        )
        for component in joint.components
    ]
    free = [sorted(r.tolist() for r in c.map.free_space) for c in joint.components]
    places = [
        (c.confidence, {n: p.tolist() for n, p in c.robots.items()}) for c in joint.components
    ]
    return [joint.version, walls, free, places, {(a.reference, a.other) for a in joint.alignments}]


def sent(sender: JointSender, message: JointMapMessage) -> bytes:
    return sender.payload(message, encode(message))


def test_what_arrives_of_a_whole_version_is_what_was_packed(random_joint: MakeJoint) -> None:
    for seed in range(20):
        message = JointMapMessage.pack(random_joint(seed), "s1")
        assert decode(JointMapMessage, encode(message)) == message


@given(st.integers(0, 2**31))
@settings(max_examples=15, deadline=None)
def test_who_hears_every_version_has_every_version_whole(
    random_joint: MakeJoint, seed: int
) -> None:
    sender, assembler = JointSender(), JointAssembler()
    for message in grow(random_joint, np.random.default_rng(seed), 6):
        arrived = assembler.update(decode(JointMapMessage, sent(sender, message)))
        assert arrived is not None
        assert content(arrived) == content(message)


def test_a_version_that_hardly_changed_is_few_bytes(random_joint: MakeJoint) -> None:
    sender, joint = JointSender(), random_joint(7)
    sizes = [
        len(sent(sender, JointMapMessage.pack(replace(joint, version=version), "s1")))
        for version in (2, 3)
    ]
    assert sizes[1] < sizes[0] / 2


def test_one_of_so_many_versions_is_complete(random_joint: MakeJoint) -> None:
    sender, joint = JointSender(), random_joint(7)
    payloads = [
        sent(sender, JointMapMessage.pack(replace(joint, version=version), "s1"))
        for version in range(1, 3 * VERSIONS_TO_COMPLETE)
    ]
    complete = [not decode(JointMapMessage, payload).changes for payload in payloads]
    for start in range(len(complete) - VERSIONS_TO_COMPLETE + 1):
        assert any(complete[start : start + VERSIONS_TO_COMPLETE])
    assert sum(complete) == 3


def test_what_changed_of_a_version_that_was_missed_is_asked_for(random_joint: MakeJoint) -> None:
    first, second, third = grow(random_joint, np.random.default_rng(1), 3)
    changes = [later.since(earlier) for earlier, later in ((first, second), (second, third))]
    sequence = JointSequence(whole_up_to=0)
    sequence.offer(first)
    sequence.offer(changes[1])
    assert [joint.version for joint in iter(sequence.take, None)] == [1]
    gap = sequence.gap
    assert gap is not None
    sequence.answered(gap, [second, third])
    assert [joint.version for joint in iter(sequence.take, None)] == [2, 3]
    assert sequence.gap is None


def test_who_hears_changes_first_asks_for_the_latest_version(random_joint: MakeJoint) -> None:
    first, second = grow(random_joint, np.random.default_rng(1), 2)
    sequence = JointSequence(whole_up_to=16)
    sequence.offer(second.since(first))
    assert sequence.take() is None
    assert sequence.gap is not None


def test_changes_of_another_version_are_no_version(random_joint: MakeJoint) -> None:
    first, second, third = grow(random_joint, np.random.default_rng(2), 3)
    changes = third.since(second)
    assert not changes.follows(first)
    with pytest.raises(MessageError, match="expected version 2 of s1 before it"):
        changes.over(first)
    with pytest.raises(MessageError, match="what changed, expected a complete version"):
        changes.unpack()


@given(st.integers(0, 2**31), st.data())
@settings(max_examples=25, deadline=None)
def test_damaged_changes_are_refused_or_a_valid_version(
    random_joint: MakeJoint, seed: int, data: st.DataObject
) -> None:
    first, second = grow(random_joint, np.random.default_rng(seed), 2)
    payload = bytearray(encode(second.since(first)))
    place = data.draw(st.integers(5, len(payload) - 1))
    payload[place] ^= data.draw(st.integers(1, 255))
    assembler = JointAssembler()
    assembler.update(first)
    try:
        arrived = assembler.update(decode(JointMapMessage, bytes(payload)))
    except MessageError:
        return
    assert arrived is None or arrived.unpack().version == arrived.version
