"""When to do something about what another lacks; no clock and no network in here.

What was published may be on its way, so nothing is done at once; who refuses it, or cannot take it,
must not be flooded, so it is done ever more rarely.
"""

from dataclasses import dataclass

GRACE = 0.75  # [s] without progress before the first time: less than statuses are apart
LONGEST = 60.0  # [s] between two times
MAX_WATCHED = 4096  # names come from the network


@dataclass
class _Lack:
    """What another lacks, and when something is done about it."""

    holds: object
    due: float
    wait: float


class Lacking:
    """Watches what others hold against what they should hold.

    Parameters
    ----------
    grace
        [s] without progress before the first time.
    """

    def __init__(self, grace: float = GRACE) -> None:
        self._grace = grace
        self._lacks: dict[str, _Lack] = {}

    def due(self, who: str, holds: object, now: float, *, lacks: bool) -> bool:
        """Tell whether something is to be done now about what `who` lacks.

        Parameters
        ----------
        who
            Names the other, and what of it is watched.
        holds
            What it holds now; while that changes it makes progress.
        now
            [s] by any clock.
        lacks
            Whether that is less than it should hold.
        """
        if not lacks:
            self._lacks.pop(who, None)
            return False
        lack = self._lacks.get(who)
        if lack is None or lack.holds != holds:
            self._watch(who, _Lack(holds, now + self._grace, self._grace))
            return False
        if now < lack.due:
            return False
        lack.wait = min(2 * lack.wait, LONGEST)
        lack.due = now + lack.wait
        return True

    def _watch(self, who: str, lack: _Lack) -> None:
        self._lacks[who] = lack
        while len(self._lacks) > MAX_WATCHED:
            del self._lacks[next(iter(self._lacks))]
