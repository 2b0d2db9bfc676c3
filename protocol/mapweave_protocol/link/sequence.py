"""Joint maps in the order of their versions, without a gap and none twice; no network in here."""

from collections import deque

from mapweave.maps import JointMap
from mapweave_protocol.wire.messages import JointMapMessage
from mapweave_protocol.wire.queries import JointQuery

MAX_WAITING = 64
ASKED_AT_ONCE = 32  # versions: a long history comes in portions
SHORT_HISTORY = 16  # versions: what a coordinator's cache holds
MAX_TRIES = 5
REMEMBERED_SERIES = 16


class JointSequence:
    """Orders the joint maps that arrive, and says what to ask the coordinator for.

    Parameters
    ----------
    whole_up_to
        If the first version that arrives is higher, it is the first to deliver, and the earlier
        ones are history; otherwise version 1 is.
    """

    def __init__(self, *, whole_up_to: int) -> None:
        self._whole_up_to = whole_up_to
        self._last: int | None = None
        self._newest = 0
        self._series: str | None = None
        self._past: deque[str] = deque(maxlen=REMEMBERED_SERIES)
        self._waiting: dict[int, JointMapMessage] = {}
        self._tries = 0

    @property
    def gap(self) -> JointQuery | None:
        """What to ask for before anything can be delivered; None if nothing is missing."""
        if self._newest <= (self._last or 0):
            return None
        if self._last is None:
            return JointQuery()
        return JointQuery(since=self._last, limit=ASKED_AT_ONCE)

    def offer(self, message: JointMapMessage) -> None:
        """Take in `message`, unless it is old."""
        if not self._follow(message.series):
            return
        if self._last is None:
            self._last = 0 if message.version <= self._whole_up_to else message.version - 1
        self._newest = max(self._newest, message.version)
        if message.version > self._last:
            self._waiting[message.version] = message
        while len(self._waiting) > MAX_WAITING:
            # The newest can be asked for again.
            del self._waiting[max(self._waiting)]

    def expect(self, series: str, version: int) -> None:
        """Note that there is a version, whether or not it arrives; another series is none of it."""
        if self._series in (None, series):
            self._newest = max(self._newest, version)

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
        """Tell whether `series` is the one to follow; a new one has numbers of its own."""
        if series in self._past:
            return False
        if self._series is not None and series != self._series:
            self._past.append(self._series)
            self._waiting.clear()
            self._last, self._newest, self._tries = None, 0, 0
            self._whole_up_to = SHORT_HISTORY
        self._series = series
        return True
