"""Joint maps in the order of their versions, without a gap and none twice; no network in here."""

from collections import deque

from mapweave.maps import JointMap
from mapweave_protocol.wire.messages import JointMapMessage
from mapweave_protocol.wire.queries import JointQuery

MAX_WAITING = 64
MAX_TRIES = 5
REMEMBERED_SERIES = 16


class JointSequence:
    """Orders the joint maps that arrive, and says what to ask the coordinator for.

    Parameters
    ----------
    from_the_first
        Whether there was no joint map yet when listening began: then version 1 is the first to
        deliver, otherwise the first that arrives.
    """

    def __init__(self, *, from_the_first: bool) -> None:
        self._last = 0 if from_the_first else None
        self._series: str | None = None
        self._past: deque[str] = deque(maxlen=REMEMBERED_SERIES)
        self._waiting: dict[int, JointMapMessage] = {}
        self._tries = 0

    @property
    def gap(self) -> JointQuery | None:
        """What to ask for before anything can be delivered; None if nothing is missing."""
        return JointQuery(since=self._last or 0) if self._waiting else None

    def offer(self, message: JointMapMessage) -> None:
        """Take in `message`, unless it is old."""
        if not self._follow(message.series):
            return
        if self._last is None:
            self._last = message.version - 1
        if message.version > self._last:
            self._waiting[message.version] = message
        while len(self._waiting) > MAX_WAITING:
            # The newest can be asked for again.
            del self._waiting[max(self._waiting)]

    def take(self) -> JointMap | None:
        """Return the next joint map, None if it is not here."""
        following = self._waiting.pop((self._last or 0) + 1, None)
        if following is None:
            return None
        self._last, self._tries = following.version, 0
        return following.unpack()

    def give_up(self) -> int:
        """Count a try to close the gap that did not help; skip the gap after several.

        Returns
        -------
        int
            How many versions were skipped.
        """
        self._tries += 1
        if self._tries < MAX_TRIES or not self._waiting:
            return 0
        skipped = min(self._waiting) - 1 - (self._last or 0)
        self._last = min(self._waiting) - 1
        return skipped

    def _follow(self, series: str) -> bool:
        """Tell whether `series` is the one to follow; a new one begins at 1 again."""
        if series in self._past:
            return False
        if self._series is not None and series != self._series:
            self._past.append(self._series)
            self._waiting.clear()
            self._last, self._tries = 0, 0
        self._series = series
        return True
