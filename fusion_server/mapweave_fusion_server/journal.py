"""What the coordinator's log tells, beside what everybody tells of a team."""

import logging
from collections.abc import Iterable, Iterator

from mapweave.maps import Alignment, JointMap

_log = logging.getLogger(__name__)


def record(lines: Iterable[str]) -> None:
    """Log `lines`; what came from the network cannot move a terminal's cursor."""
    for line in lines:
        _log.info("%s", "".join(c if c.isprintable() else "?" for c in line))


def tell_set_aside(used: Iterable[Alignment], joint: JointMap) -> Iterator[str]:
    """Yield a line for each accepted alignment that `joint` does not rely on after all."""
    accepted = {(a.reference, a.other) for a in used if a.decision == "accepted"}
    for alignment in joint.alignments:
        pair = alignment.reference, alignment.other
        if pair in accepted and alignment.decision != "accepted":
            yield f"not relied on: {pair[0]} and {pair[1]}: {alignment.reason}"
