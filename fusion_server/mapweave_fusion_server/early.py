"""What was found about maps that are not here yet: they may be on their way, or of nobody."""

from dataclasses import dataclass

from mapweave_protocol.wire.messages import AlignmentMessage
from mapweave_protocol.wire.pairs import Run, states_of

MOST = 256  # pairs of runs


@dataclass(frozen=True, slots=True)
class EarlyAlignment:
    """A message, its bytes, and when it came [s since 1970]."""

    message: AlignmentMessage
    payload: bytes
    received: float

    @property
    def runs(self) -> frozenset[Run]:
        """Of which runs it is."""
        return frozenset(states_of((self.message.reference, self.message.other)))


class EarlyAlignments:
    """Keeps the last message of each pair of runs; of too many pairs the oldest goes."""

    def __init__(self) -> None:
        self._found: dict[frozenset[Run], EarlyAlignment] = {}

    def keep(self, found: EarlyAlignment) -> None:
        """Keep `found` until its maps are here."""
        self._found.pop(found.runs, None)
        self._found[found.runs] = found
        if len(self._found) > MOST:
            del self._found[next(iter(self._found))]

    def take(self, robot: str, boot: str) -> list[EarlyAlignment]:
        """Return what was kept about a run, and keep it no longer."""
        about = [found for runs, found in self._found.items() if (robot, boot) in runs]
        for found in about:
            del self._found[found.runs]
        return about
