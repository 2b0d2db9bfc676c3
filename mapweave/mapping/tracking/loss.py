"""Lost only when lost: what was missed is a place of its own, or nothing was seen at all.

Scans that fit nowhere may be of another place, or show hardly more than what is in the way: a crowd
about the robot. The former fit each other, the latter nothing. From these nothing could be mapped,
so the robot is looked for where it was a while longer.
"""

from mapweave.mapping.tracking.observation import Observation
from mapweave.mapping.tracking.tracker import Tracker
from mapweave.maps import LineMap

LONGER = 2  # times the patience, for scans that fit not even each other


class Loss:
    """Follows the scans that a tracker missed by one of their own.

    Parameters
    ----------
    patience
        How many of them may be missed at the least.
    """

    def __init__(self, patience: int) -> None:
        self._patience = patience
        self._other: Tracker | None = None
        self._blind = self._fitting = 0

    def note(self, seen: Observation, tracker: Tracker, *, placed: bool) -> None:
        """Note that a scan was placed by the `tracker`, or missed."""
        if placed or not tracker.missed:
            self._other, self._blind, self._fitting = None, 0, 0
            return
        if self._other is None or len(self._other.missed) >= self._patience:
            self._other, self._fitting = tracker.afresh(trusting=True), 0
        self._blind += tracker.is_blind(seen)
        self._fitting += len(self._other.place(seen, LineMap.empty))

    def is_certain(self, missed: int, patience: int) -> bool:
        """Whether a robot is lost that missed so many scans in a row.

        It is once these are as many as its present `patience`, if most of so many fit each other,
        or most of them show nothing; and in any case when many more were missed.
        """
        if missed < patience:
            return False
        shown = 2 * max(self._fitting, self._blind) > self._patience
        return shown or missed >= patience + LONGER * self._patience
