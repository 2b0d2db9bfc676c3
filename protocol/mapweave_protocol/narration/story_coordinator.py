"""Whether a team's coordinator is here and speaks, told when that changes; no clock in here."""

from collections.abc import Iterator

from mapweave_protocol.link.claimants import Claimants, tell_coordinators
from mapweave_protocol.link.status_schedule import SILENCE


class CoordinatorStory:
    """Tells that a coordinator is here, gone or silent, and if there are several."""

    def __init__(self) -> None:
        self._claimants = Claimants()
        self._was_here = self._is_silent = False
        self._heard = 0.0

    @property
    def here(self) -> bool:
        """Whether one is."""
        return bool(self._claimants.boots)

    def came(self, boot: str, now: float) -> Iterator[str]:
        """Tell that one is here, and if it is not the only one."""
        before = self.here
        count = self._claimants.take(boot, here=True)
        if count:
            yield tell_coordinators(count)
        elif not before:
            self._heard, self._is_silent = now, False
            yield f"the coordinator is here{' again' if self._was_here else ''}"
        self._was_here = True

    def left(self, boot: str) -> Iterator[str]:
        """Tell that the last one is gone."""
        before = self.here
        self._claimants.take(boot, here=False)
        if before and not self.here:
            yield "the coordinator is gone"

    def spoke(self, now: float) -> Iterator[str]:
        """Tell that one speaks that was silent."""
        self._heard = now
        if self._is_silent:
            self._is_silent = False
            yield "the coordinator is heard again"

    def excuse(self, now: float) -> None:
        """Note that nothing could be heard until `now` [s]."""
        self._heard = max(self._heard, now)

    def look(self, now: float) -> Iterator[str]:
        """Tell once that one is here and has been silent for too long."""
        if self.here and not self._is_silent and now - self._heard > SILENCE:
            self._is_silent = True
            yield f"the coordinator has said nothing for {SILENCE:.0f} s"
