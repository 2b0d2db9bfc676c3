"""What a version no longer relies on, it says, and since when; so do those that follow."""

from dataclasses import replace

import numpy as np

from mapweave.maps import Alignment, Decision, JointMap
from mapweave.reasons import Reason, ReasonKind, Status, StatusKind
from mapweave.team.revocation import mark_revoked


def found(
    decision: Decision, cause: Reason, reference: str = "a/0", other: str = "b/0"
) -> Alignment:
    return Alignment(reference, other, np.zeros(3), decision, 0.9, cause)


def following(before: JointMap | None, *alignments: Alignment) -> JointMap:
    """Return the version after `before` that judges `alignments` so."""
    version = before.version + 1 if before else 1
    judged = JointMap(version, (), alignments)
    return mark_revoked(judged, before.alignments if before else ())


MUCH, LITTLE = Reason.words("40 m in common"), Reason.words("only 2 m in common")
ACCEPTED = replace(found("accepted", MUCH), status=Status(StatusKind.RELIED_ON))
REFUSED = found("refused", LITTLE)
OFF = Reason(ReasonKind.OTHERS_CONTRADICT, {"distance": 9.0, "turn": 0.0}, MUCH)
BY = (("a/0", "c/0"),)
ASIDE = replace(found("ambiguous", OFF), status=Status(StatusKind.SET_ASIDE, BY))


def reasons(joint: JointMap) -> list[str]:
    return [alignment.reason for alignment in joint.alignments]


def statuses(joint: JointMap) -> list[Status | None]:
    return [alignment.status for alignment in joint.alignments]


def test_the_first_version_that_does_not_rely_on_it_revokes_it() -> None:
    joint = following(following(None, ACCEPTED), REFUSED)
    assert reasons(joint) == ["revoked in version 2: only 2 m in common"]
    assert joint.alignments[0].decision == "refused"
    assert statuses(joint) == [Status(StatusKind.REVOKED, revoked_in=2)]


def test_what_is_set_aside_after_it_was_relied_on_is_revoked() -> None:
    joint = following(following(None, ACCEPTED), ASIDE)
    assert reasons(joint) == [
        "revoked in version 2: 9.0 m and 0° off what a/0-c/0 says; 40 m in common"
    ]
    assert statuses(joint) == [Status(StatusKind.REVOKED, BY, revoked_in=2)]


def test_later_versions_keep_saying_since_when() -> None:
    joint = following(following(following(None, ACCEPTED), ASIDE), REFUSED)
    assert reasons(joint) == ["revoked in version 2: only 2 m in common"]


def test_what_is_relied_on_again_is_no_longer_revoked_until_the_next_time() -> None:
    again = following(following(following(None, ACCEPTED), REFUSED), ACCEPTED)
    assert reasons(again) == ["40 m in common"]
    assert statuses(again) == [Status(StatusKind.RELIED_ON)]
    assert reasons(following(again, REFUSED)) == ["revoked in version 4: only 2 m in common"]


def test_what_no_version_relied_on_is_not_revoked() -> None:
    joint = following(following(None, REFUSED), ASIDE)
    assert reasons(joint) == ["set aside: 9.0 m and 0° off what a/0-c/0 says; 40 m in common"]
    assert statuses(joint) == [Status(StatusKind.SET_ASIDE, BY)]
    assert statuses(following(joint, REFUSED)) == [None]


def test_it_does_not_matter_which_of_the_two_is_the_reference() -> None:
    turned = found("refused", LITTLE, "b/0", "a/0")
    assert reasons(following(following(None, ACCEPTED), turned)) == [
        "revoked in version 2: only 2 m in common"
    ]


def test_other_pairs_are_left_alone() -> None:
    other = found("refused", Reason.words("nothing in common"), "a/0", "c/0")
    joint = following(following(None, ACCEPTED), ACCEPTED, other)
    assert reasons(joint) == ["40 m in common", "nothing in common"]


def test_a_reason_stays_as_short_as_a_message_allows() -> None:
    long = found("refused", Reason.words("x" * 500))
    (reason,) = reasons(following(following(None, ACCEPTED), long))
    assert len(reason) == 500
    assert reason.startswith("revoked in version 2: xxx")


def test_a_last_version_of_a_program_that_told_no_status_is_understood_by_its_decisions() -> None:
    untold = JointMap(1, (), (replace(ACCEPTED, status=None),))
    assert statuses(following(untold, REFUSED)) == [Status(StatusKind.REVOKED, revoked_in=2)]
