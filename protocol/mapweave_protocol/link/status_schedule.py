"""When to say how one is: when something has changed, when somebody comes, and now and then.

No clock and no network in here.
"""

import math

from mapweave_protocol.link.lacking import GRACE

COORDINATOR_INTERVAL = 15.0  # [s] between statuses of a coordinator, though nothing changes
SILENCE = 1.5 * COORDINATOR_INTERVAL  # [s] in which no coordinator is heard
AGAIN = GRACE + 0.5  # [s] after somebody came: what is still missing then did not arrive by itself
TIMES = 2  # that it is said again: the first status may come before the other's link is whole


class StatusSchedule:
    """When a robot or a coordinator says how it is.

    Parameters
    ----------
    interval
        [s] from one status to the next, though nothing changes; half of it while something lacks.
    least
        [s] from one status to the next, whatever changes.
    """

    def __init__(self, interval: float, least: float) -> None:
        self._interval = interval
        self._least = least
        self._said: object = None
        self._last = -math.inf
        self._met = -math.inf

    def met(self, now: float) -> None:
        """Note that somebody came: who was away hears at once what is here, and again.

        The second time tells whether what the first one said was missing is still on its way.
        """
        self._last = min(self._last, now - self._interval)
        self._met = now

    def hurry(self) -> None:
        """Note that there is something that is waited for."""
        self._last = -math.inf

    def may_be_due(self, now: float) -> bool:
        """Tell whether a status may be sent by `now` [s]: whether it is worth making one."""
        return now - self._last >= self._least

    def due(self, now: float, state: object, *, lacks: bool = False) -> bool:
        """Tell whether a status is to be sent.

        Parameters
        ----------
        now
            [s] by any clock.
        state
            What others are told of at once when it changes.
        lacks
            Whether something is known of that is not here: who has it is told again sooner.
        """
        if not self.may_be_due(now):
            return False
        times = (self._met + k * AGAIN for k in range(1, TIMES + 1))
        again = any(self._last < time <= now for time in times)
        interval = self._interval / 2 if lacks else self._interval
        return again or state != self._said or now - self._last >= interval

    def sent(self, now: float, state: object) -> None:
        """Note that a status was sent."""
        self._last, self._said = now, state
