"""Joins that are kept: maps that were joined do not come apart because they have grown.

Robots that met go on exploring, and the farther their maps reach from what they share, the less
sure an alignment is right for them as wholes. That the places are one is as sure as it was, so the
join stays, with the confidence that is left; only what speaks against the place undoes it.
"""

from collections.abc import Sequence
from dataclasses import replace

from mapweave.alignment_graph import shortened
from mapweave.maps import Alignment

KEPT = "joined before; "  # begins the reason of a join that is kept


def keep_joined(
    alignments: Sequence[Alignment], before: Sequence[Alignment]
) -> tuple[Alignment, ...]:
    """Return `alignments`, with those accepted that only the maps' reach made ambiguous since.

    Parameters
    ----------
    before
        What was found the last time, of the same pairs.
    """
    joined = {_pair(alignment) for alignment in before if alignment.decision == "accepted"}
    return tuple(_keep(a) if _pair(a) in joined and _same_place(a) else a for a in alignments)


def _same_place(alignment: Alignment) -> bool:
    """Whether what was compared proves the `place`, and only the maps' reach leaves it open."""
    return alignment.decision == "ambiguous" and "place" in alignment.evidence


def _keep(alignment: Alignment) -> Alignment:
    return replace(alignment, decision="accepted", reason=shortened(KEPT + alignment.reason))


def _pair(alignment: Alignment) -> frozenset[str]:
    return frozenset({alignment.reference, alignment.other})
