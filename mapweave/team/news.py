"""Whether it is worth telling the team what was found out about two maps, after it was told before.

Maps are compared again whenever they have grown, and mostly it comes to the same.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from mapweave.geometry import se2
from mapweave.maps import Alignment

MOVED = 0.03  # [m]: as far as a scan's place in a map is known
TURNED = np.radians(0.3)
SURER = 0.02  # of a confidence
GROWN = 4.0  # times the wall in common


def is_news(found: Sequence[Alignment], told: Sequence[Alignment]) -> bool:
    """Tell whether `found` differs from what was `told` by more than comparing again does.

    Of what was not joined only a decision is news: nothing is built on the rest.
    """
    before, after = _by_names(told), _by_names(found)
    if before.keys() != after.keys():
        return True
    return any(_differs(after[names], before[names]) for names in after)


def _by_names(found: Sequence[Alignment]) -> Mapping[tuple[str, str], Alignment]:
    return {(alignment.reference, alignment.other): alignment for alignment in found}


def _differs(after: Alignment, before: Alignment) -> bool:
    if after.decision != before.decision:
        return True
    if after.decision != "accepted":
        return False
    step = se2.between(before.transform, after.transform)
    moved = np.hypot(step[0], step[1]) > MOVED or abs(step[2]) > TURNED
    surer = abs(after.confidence - before.confidence) > SURER
    grown = (after.evidence.common or 0.0) > GROWN * (before.evidence.common or 0.0)
    return bool(moved or surer or grown)
