"""Robots that were heard of and of which no map is here: names cost nothing, so they are few."""

from collections.abc import Callable

MOST = 64


class Strangers:
    """Robots without a map here; of too many, the one unheard for longest is forgotten.

    So no number of invented names keeps a robot out that comes with a map.

    Parameters
    ----------
    forget
        Called with a name that is forgotten.
    """

    def __init__(self, forget: Callable[[str], object]) -> None:
        self._forget = forget
        self._names: dict[str, None] = {}

    def heard(self, robot: str, *, has_map: bool) -> None:
        """Note that `robot` was heard, and whether a map of it is here."""
        self._names.pop(robot, None)
        if has_map:
            return
        self._names[robot] = None
        if len(self._names) > MOST:
            longest = next(iter(self._names))
            del self._names[longest]
            self._forget(longest)
