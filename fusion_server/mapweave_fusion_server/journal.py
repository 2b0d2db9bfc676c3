"""What the coordinator's log tells, beside what everybody tells of a team."""

import logging
from collections.abc import Iterable

_log = logging.getLogger(__name__)


def record(lines: Iterable[str]) -> None:
    """Log `lines`; what came from the network cannot move a terminal's cursor."""
    for line in lines:
        _log.info("%s", "".join(c if c.isprintable() else "?" for c in line))
