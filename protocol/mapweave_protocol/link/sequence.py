"""Joint maps in the order of their versions, without a gap and none twice; no network in here.

Anybody may publish what looks like a version, so what is published is a hint: whether there is one
so far ahead, and which numbering is the team's, is what the coordinator answers when it is asked.
"""

import logging
import math
from collections.abc import Sequence

from mapweave.maps import JointMap
from mapweave_protocol.errors import MessageError
from mapweave_protocol.link.joint_changes import JointAssembler
from mapweave_protocol.wire.messages import JointMapMessage
from mapweave_protocol.wire.queries import JointQuery

_log = logging.getLogger(__name__)
MAX_WAITING = 64
ASKED_AT_ONCE = 32  # versions: a long history comes in portions
SHORT_HISTORY = 16  # versions: what a coordinator's cache holds
MAX_TRIES = 5
ASKED_AFTER, ASKED_AFTER_AT_MOST = 1.0, 60.0  # [s] before it is asked again whose series counts


class JointSequence:
    """Orders the joint maps that arrive, and says what to ask the coordinator for.

    Parameters
    ----------
    whole_up_to
        If the first version that arrives is higher, it is the first to deliver, and the earlier
        ones are history; otherwise version 1 is.
    since
        Deliver all versions after this one instead; of a series that has not come so far, all.
    """

    def __init__(self, *, whole_up_to: int, since: int | None = None) -> None:
        self._whole_up_to = whole_up_to
        self._since = since  # until something is delivered
        self._last: int | None = since
        self._newest = 0
        self._series: str | None = None
        self._waiting: dict[int, JointMapMessage] = {}
        self._assembler = JointAssembler()
        self._tries = 0
        self._has_answer = False
        self._strangers = _Strangers()

    @property
    def gap(self) -> JointQuery | None:
        """What to ask for before anything can be delivered; None if nothing is missing."""
        if self._strangers.is_to_ask:
            return JointQuery()
        if self._newest <= (self._last or 0):
            return None
        unknown = self._last is None or self._series is None
        if unknown or self._tries == MAX_TRIES - 1:
            return JointQuery()  # is there such a version at all?
        return JointQuery(since=self._last, limit=ASKED_AT_ONCE)

    def offer(self, message: JointMapMessage, now: float = 0.0) -> None:
        """Take in `message`, which somebody published, unless it is old or of another series.

        Parameters
        ----------
        now
            [s] by any clock that is not set.
        """
        if self._series is None:
            self._series = message.series
        if message.series != self._series:
            self._strangers.spoke(now)
            return
        self._strangers.own_spoke()
        self._take_in(message)

    def answered(
        self, query: JointQuery, messages: Sequence[JointMapMessage], now: float = 0.0
    ) -> None:
        """Take in the answers to `query`; `now` as of `offer`."""
        self._has_answer |= any(message.series == self._series for message in messages)
        if query == JointQuery():
            self._strangers.answered(now)
            self._follow({message.series for message in messages})
        else:
            self._pass_over_history(messages)
        own = [message for message in messages if message.series == self._series]
        for message in own:
            self._take_in(message)
        if own and query == JointQuery():
            self._believe(max(message.version for message in own))
            self._tries *= int(self._newest > (self._last or 0))

    def expect(self, series: str, version: int, now: float = 0.0) -> None:
        """Note that there is a version, whether or not it arrives; of another series none is."""
        if self._series in (None, series):
            self._strangers.own_spoke()
            self._newest = max(self._newest, version)
            if self._since is not None and version < self._since:
                self._last = 0
        else:
            self._strangers.spoke(now)

    def take(self) -> JointMap | None:
        """Return the next joint map, None if it is not here."""
        following = self._waiting.pop((self._last or 0) + 1, None)
        whole = None if following is None else self._whole(following)
        if whole is None:
            return None
        self._last, self._tries, self._since = whole.version, 0, None
        return whole.unpack()

    def give_up(self) -> int:
        """Count a try to close the gap that did not help; skip the gap after several.

        Where nobody has answered, what is far ahead is forgotten instead: it may be of nobody. What
        is near may be there still when the coordinator is back.

        Returns
        -------
        int
            How many versions were skipped.
        """
        self._tries += 1
        if self._tries < MAX_TRIES:
            return 0
        self._tries, last = 0, self._last or 0
        self._believe(min(self._newest, max(last, self._whole_up_to) + MAX_WAITING))
        answered, self._has_answer = self._has_answer, False
        if not self._waiting:
            self._newest = last
        if not self._waiting or not answered:
            return 0
        self._last = min(self._waiting) - 1
        return self._last - last

    def _whole(self, message: JointMapMessage) -> JointMapMessage | None:
        """Return `message` complete; None where it is not, and is to be asked for."""
        try:
            return self._assembler.update(message)
        except MessageError as error:
            _log.warning("%s: asked for again", error)
            return None

    def _take_in(self, message: JointMapMessage) -> None:
        if self._last is None and message.changes:
            # What it changes is not here, so the latest version is asked for.
            self._newest = max(self._newest, message.version)
            return
        if self._last is None:
            self._last = 0 if message.version <= self._whole_up_to else message.version - 1
        self._newest = max(self._newest, message.version)
        if message.version > self._last:
            self._waiting[message.version] = message
        while len(self._waiting) > MAX_WAITING:
            # The newest can be asked for again.
            del self._waiting[max(self._waiting)]

    def _follow(self, answering: set[str]) -> None:
        """Follow another series where the coordinator that answers has another one."""
        if not answering or self._series in answering:
            return
        before, self._series = self._series, min(answering)
        if before is None:
            return
        self._waiting.clear()
        self._last, self._newest, self._tries = None, 0, 0
        self._whole_up_to = SHORT_HISTORY
        self._strangers = _Strangers()

    def _believe(self, latest: int) -> None:
        """Forget what is said to come after the version `latest`."""
        self._newest = max(latest, self._last or 0)
        self._waiting = {n: message for n, message in self._waiting.items() if n <= latest}

    def _pass_over_history(self, messages: Sequence[JointMapMessage]) -> None:
        """Where a store began another series, what is of the one before is history.

        Only what lies below all that is of the series followed is of such a store: another
        coordinator numbers as it likes.
        """
        own = min((m.version for m in messages if m.series == self._series), default=0)
        before = [m.version for m in messages if m.version < own]
        if before and self._last is not None and self._last < max(before) <= SHORT_HISTORY:
            self._last = max(before)


class _Strangers:
    """When to ask whose series counts: ever more rarely, while the one that is followed speaks."""

    def __init__(self) -> None:
        self.is_to_ask = False
        self._due = -math.inf
        self._wait = ASKED_AFTER
        self._has_own_spoken = False

    def spoke(self, now: float) -> None:
        """Note that something came of another series."""
        self.is_to_ask |= now >= self._due

    def own_spoke(self) -> None:
        """Note that something came of the series that is followed."""
        self._has_own_spoken = True

    def answered(self, now: float) -> None:
        """Note that it was asked."""
        longer = min(2 * self._wait, ASKED_AFTER_AT_MOST)
        self._wait = longer if self._has_own_spoken else ASKED_AFTER
        self.is_to_ask, self._has_own_spoken, self._due = False, False, now + self._wait
