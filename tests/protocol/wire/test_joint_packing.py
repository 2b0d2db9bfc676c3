"""Versions of a joint map, packed one after the other."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from mapweave.evidence import Evidence
from mapweave.maps import Alignment, JointMap, LineMap, SharedPlace
from mapweave.reasons import Reason, ReasonKind, Status, StatusKind
from mapweave_protocol.wire import geometry
from mapweave_protocol.wire.alignment_message import AlignmentPacker
from mapweave_protocol.wire.codec import decode, encode
from mapweave_protocol.wire.coding.extensions import extended
from mapweave_protocol.wire.joint_message import JointPacker
from mapweave_protocol.wire.messages import JointMapMessage

MakeJoint = Callable[..., JointMap]
PLACE = SharedPlace(1, 2, np.array([0.5, 1.0, 0.2]), np.array([3.0, 4.0]))
FIRST, SECOND = (
    Alignment(
        "a/0",
        f"{robot}/0",
        np.array([1.25, -3.0, 0.1]),
        "accepted",
        0.9,
        Reason(ReasonKind.CONVINCING, {"common": 9.5, "contradicted": 0.0}),
        Evidence(common=9.5, held=4.0),
        places=(PLACE,),
    )
    for robot in "bc"
)


def test_what_is_packed_holds_the_lines_that_arrive(random_joint: MakeJoint) -> None:
    packed = JointMapMessage.pack(random_joint(3), "s1")
    arrived = decode(JointMapMessage, encode(packed))
    assert arrived == packed
    for sent, found in zip(packed.components, arrived.components, strict=True):
        for one, other in zip(sent.lines.columns, found.lines.columns, strict=True):
            np.testing.assert_array_equal(one, other)


def test_more_wall_than_receivers_take_is_refused_where_it_is_packed(
    random_joint: MakeJoint, monkeypatch: pytest.MonkeyPatch
) -> None:
    joint = random_joint(3)
    JointMapMessage.pack(joint, "s1")
    monkeypatch.setattr(geometry, "MAX_WALL", 0.01)
    with pytest.raises(ValueError, match="of wall, expected at most"):
        JointMapMessage.pack(joint, "s1")


def test_an_alignment_that_stays_is_packed_once_and_one_that_changed_anew() -> None:
    packer = AlignmentPacker()
    before = packer.pack([FIRST, SECOND])
    held = replace(SECOND, status=Status(StatusKind.HELD))
    after = packer.pack([replace(FIRST), held])
    assert after[0] is before[0]
    assert after == AlignmentPacker().pack([FIRST, held]) != before


@pytest.mark.parametrize(
    "changed",
    [
        {"confidence": 0.8},
        {"decision": "ambiguous"},
        {"transform": np.array([1.25, -3.0, 0.2])},
        {"cause": Reason(ReasonKind.UNDECIDED, found=FIRST.cause)},
        {"evidence": Evidence(common=9.0)},
        {"places": ()},
    ],
)
def test_whatever_changes_of_an_alignment_travels(changed: dict[str, object]) -> None:
    packer = AlignmentPacker()
    packer.pack([FIRST])
    other = replace(FIRST, **changed)  # type: ignore[arg-type]
    assert packer.pack([other]) == AlignmentPacker().pack([other]) != packer.pack([FIRST])


def test_a_copy_with_another_value_travels_with_it() -> None:
    [wire] = AlignmentPacker().pack([FIRST])
    assert wire.values()[4] == extended(0.9)
    assert wire.model_copy(update={"confidence": 0.5}).values()[4] == extended(0.5)


def test_lines_that_stay_are_packed_once_and_what_changes_of_them_anew(
    random_joint: MakeJoint,
) -> None:
    joint, packer = random_joint(3), JointPacker()
    before = JointMapMessage.pack(joint, "s1", packer)
    first = joint.components[0]
    other = replace(first, segment_confidence=first.segment_confidence * 0.5)
    poses = {name: pose + 1.0 for name, pose in first.robots.items()}
    for changed in (
        first,
        replace(first, robots=poses),
        other,
        replace(first, map=LineMap.empty(), segment_confidence=np.empty(0)),
    ):
        version = replace(joint, components=(changed, *joint.components[1:]))
        after = JointMapMessage.pack(version, "s1", packer)
        assert after == JointMapMessage.pack(version, "s1")
        same = changed.map is first.map and changed is not other
        assert (after.components[0].lines is before.components[0].lines) == same
