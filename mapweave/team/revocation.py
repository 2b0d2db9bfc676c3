"""Joins that are undone: the version that no longer relies on an alignment says so, and why.

A later version that still does not rely on it keeps saying which version undid it.
"""

from collections.abc import Sequence
from dataclasses import replace

from mapweave.maps import Alignment, JointMap
from mapweave.reasons import Status, StatusKind


def mark_revoked(joint: JointMap, before: Sequence[Alignment]) -> JointMap:
    """Return `joint`, in which what `before`, those of the last version, relied on is revoked."""
    last = {_pair(alignment): alignment for alignment in before}
    marked = tuple(_mark(a, last.get(_pair(a)), joint.version) for a in joint.alignments)
    return replace(joint, alignments=marked)


def _mark(alignment: Alignment, before: Alignment | None, version: int) -> Alignment:
    if before is None or alignment.decision == "accepted":
        return alignment
    if before.decision == "accepted":
        revoked_in = version
    elif before.status is not None and before.status.revoked_in is not None:
        revoked_in = before.status.revoked_in
    else:
        return alignment
    by = () if alignment.status is None else alignment.status.set_aside_by
    return replace(alignment, status=Status(StatusKind.REVOKED, by, revoked_in))


def _pair(alignment: Alignment) -> frozenset[str]:
    return frozenset({alignment.reference, alignment.other})
