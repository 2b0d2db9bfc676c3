"""Joins that are undone: the version that no longer relies on an alignment says so, and why.

A later version that still does not rely on it keeps saying which version undid it.
"""

import re
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

from mapweave.maps import Alignment, JointMap
from mapweave.team.alignment_graph import SET_ASIDE, shortened

_MARK = re.compile(r"revoked in version ([0-9]{1,16}): ")


class Objection(NamedTuple):
    """Why an alignment that was accepted once is not relied on.

    Attributes
    ----------
    revoked
        The version that no longer relied on it; None when none ever did.
    reason
        In words.
    """

    revoked: int | None
    reason: str


def mark_revoked(joint: JointMap, before: Sequence[Alignment]) -> JointMap:
    """Return `joint`, in which what `before`, those of the last version, relied on is revoked."""
    last = {_pair(alignment): alignment for alignment in before}
    marked = tuple(_mark(a, last.get(_pair(a)), joint.version) for a in joint.alignments)
    return replace(joint, alignments=marked)


def objection(alignment: Alignment) -> Objection | None:
    """Return why `alignment` is not relied on though it was accepted once; None otherwise."""
    if alignment.decision == "accepted":
        return None
    mark = _MARK.match(alignment.reason)
    if mark:
        return Objection(int(mark[1]), alignment.reason[mark.end() :].removeprefix(SET_ASIDE))
    if alignment.reason.startswith(SET_ASIDE):
        return Objection(None, alignment.reason.removeprefix(SET_ASIDE))
    return None


def _mark(alignment: Alignment, before: Alignment | None, version: int) -> Alignment:
    if before is None or alignment.decision == "accepted":
        return alignment
    earlier = objection(before)
    if before.decision == "accepted":
        revoked = version
    elif earlier is not None and earlier.revoked is not None:
        revoked = earlier.revoked
    else:
        return alignment
    reason = alignment.reason.removeprefix(SET_ASIDE)
    return replace(alignment, reason=shortened(f"revoked in version {revoked}: {reason}"))


def _pair(alignment: Alignment) -> frozenset[str]:
    return frozenset({alignment.reference, alignment.other})
