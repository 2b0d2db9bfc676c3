"""What comes of a comparison: what is published of it."""

import logging
from collections.abc import Sequence

from mapweave.maps import Alignment
from mapweave.team.hysteresis import keep_joined
from mapweave_agent.comparison_schedule import Comparison
from mapweave_agent.comparison_worker import ComparisonOutcome
from mapweave_protocol.wire.messages import AlignmentMessage, MapVersion

_log = logging.getLogger(__name__)


def found_in(outcome: ComparisonOutcome, *, have_met: bool) -> Sequence[Alignment] | None:
    """Return what was found, None where comparing failed.

    Parameters
    ----------
    have_met
        Whether the two runs were joined once: they stay so where the place is proven.
    """
    if outcome.alignments is None:
        # What was found out about earlier versions of the pair stands.
        _log.error("comparing with %s failed: %s", outcome.comparison.peer, outcome.failure)
        return None
    return keep_joined(outcome.alignments) if have_met else outcome.alignments


def message_of(robot: str, comparison: Comparison, found: Sequence[Alignment]) -> AlignmentMessage:
    """Return the message of what `robot` found."""
    reference, other = (MapVersion.of(m) for m in (comparison.reference, comparison.other))
    return AlignmentMessage.pack(robot, reference, other, found)
