"""What the coordinator's log tells, beside what everybody tells of a team."""

import logging
from collections.abc import Iterable

LOGGER = logging.getLogger(__name__)


def record(lines: Iterable[str]) -> None:
    """Log `lines`; what came from the network cannot move a terminal's cursor."""
    for line in lines:
        LOGGER.info("%s", "".join(c if c.isprintable() else "?" for c in line))
