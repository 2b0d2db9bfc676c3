"""What a version no longer relies on, it says, and since when; so do those that follow."""

import numpy as np

from mapweave.maps import Alignment, Decision, JointMap
from mapweave.team.revocation import Objection, mark_revoked, objection


def found(decision: Decision, reason: str, reference: str = "a/0", other: str = "b/0") -> Alignment:
    return Alignment(reference, other, np.zeros(3), decision, 0.9, reason)


def following(before: JointMap | None, *alignments: Alignment) -> JointMap:
    """Return the version after `before` that judges `alignments` so."""
    version = before.version + 1 if before else 1
    judged = JointMap(version, (), alignments)
    return mark_revoked(judged, before.alignments if before else ())


ACCEPTED = found("accepted", "40 m in common")
REFUSED = found("refused", "only 2 m in common")
ASIDE = found("ambiguous", "set aside: 9.0 m and 0° off what a/0-c/0 says; 40 m in common")


def reasons(joint: JointMap) -> list[str]:
    return [alignment.reason for alignment in joint.alignments]


def test_the_first_version_that_does_not_rely_on_it_revokes_it() -> None:
    joint = following(following(None, ACCEPTED), REFUSED)
    assert reasons(joint) == ["revoked in version 2: only 2 m in common"]
    assert joint.alignments[0].decision == "refused"
    assert objection(joint.alignments[0]) == Objection(2, "only 2 m in common")


def test_what_is_set_aside_after_it_was_relied_on_is_revoked() -> None:
    joint = following(following(None, ACCEPTED), ASIDE)
    assert reasons(joint) == [
        "revoked in version 2: 9.0 m and 0° off what a/0-c/0 says; 40 m in common"
    ]


def test_later_versions_keep_saying_since_when() -> None:
    joint = following(following(following(None, ACCEPTED), ASIDE), REFUSED)
    assert reasons(joint) == ["revoked in version 2: only 2 m in common"]


def test_what_is_relied_on_again_is_no_longer_revoked_until_the_next_time() -> None:
    again = following(following(following(None, ACCEPTED), REFUSED), ACCEPTED)
    assert reasons(again) == ["40 m in common"]
    assert reasons(following(again, REFUSED)) == ["revoked in version 4: only 2 m in common"]


def test_what_no_version_relied_on_is_not_revoked() -> None:
    joint = following(following(None, REFUSED), ASIDE)
    assert reasons(joint) == [ASIDE.reason]
    found_aside = objection(joint.alignments[0])
    assert found_aside == Objection(None, "9.0 m and 0° off what a/0-c/0 says; 40 m in common")
    assert objection(REFUSED) is None
    assert objection(ACCEPTED) is None


def test_it_does_not_matter_which_of_the_two_is_the_reference() -> None:
    turned = found("refused", "only 2 m in common", "b/0", "a/0")
    assert reasons(following(following(None, ACCEPTED), turned)) == [
        "revoked in version 2: only 2 m in common"
    ]


def test_other_pairs_are_left_alone() -> None:
    other = found("refused", "nothing in common", "a/0", "c/0")
    joint = following(following(None, ACCEPTED), ACCEPTED, other)
    assert reasons(joint) == ["40 m in common", "nothing in common"]


def test_a_reason_stays_as_short_as_a_message_allows() -> None:
    long = found("refused", "x" * 500)
    (reason,) = reasons(following(following(None, ACCEPTED), long))
    assert len(reason) == 500
    assert reason.startswith("revoked in version 2: xxx")
