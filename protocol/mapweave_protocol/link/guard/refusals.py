"""What was refused, counted by who sent it and what it was; a line a kind a minute."""

import logging
import time
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from mapweave.text import shown
from mapweave_protocol.wire.status_message import MAX_REFUSED

INTERVAL = 60.0  # [s] between two lines about one kind
MOST_SENDERS = 64  # names come from the network: those after count as one
OTHERS = "others"

_log = logging.getLogger(__name__)


@dataclass
class _Kind:
    """A kind of message: when it was told last, and what came since."""

    told: float
    untold: int = 0


class Refusals:
    """Counts what is refused; usable from one thread.

    Parameters
    ----------
    clock
        Returns the time [s].
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._counts: Counter[tuple[str, str]] = Counter()
        self._senders: set[str] = set()
        self._kinds: dict[str, _Kind] = {}

    @property
    def total(self) -> int:
        """How many were refused."""
        return self._counts.total()

    @property
    def counts(self) -> Mapping[tuple[str, str], int]:
        """How many of each sender and kind."""
        return dict(self._counts)

    @property
    def told(self) -> dict[str, int]:
        """What goes into a status: the most frequent ones, as ``r1 map``."""
        return {f"{who} {kind}": n for (who, kind), n in self._counts.most_common(MAX_REFUSED)}

    def add(self, sender: str, kind: str, where: str, why: object) -> None:
        """Count one, and tell it unless one of its kind was told a short while ago.

        Parameters
        ----------
        sender
            Who it says it is from.
        kind
            What it is, one of a few words of ours.
        where
            The key that it came by.
        why
            What is wrong with it.
        """
        if sender not in self._senders and len(self._senders) >= MOST_SENDERS:
            sender = OTHERS
        self._senders.add(sender)
        self._counts[sender, kind] += 1
        now = self._clock()
        last = self._kinds.setdefault(kind, _Kind(-INTERVAL + now))
        if now - last.told < INTERVAL:
            last.untold += 1
            return
        more = f" ({last.untold} more {kind} refused since the last line)" if last.untold else ""
        _log.warning("%s: refused, %s%s", shown(where), shown(str(why), 300), more)
        self._kinds[kind] = _Kind(now)
