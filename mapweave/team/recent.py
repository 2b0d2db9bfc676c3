"""What was made, kept for as long as it is asked for."""

from collections.abc import Callable, Hashable
from typing import Generic, TypeVar

K = TypeVar("K", bound=Hashable)
V = TypeVar("V")


class Recent(Generic[K, V]):
    """Values by what they are made of; those that two turns in a row did not ask for are dropped.

    A value must depend on its key alone: so what is kept is what would be made anew.
    """

    def __init__(self) -> None:
        self._before: dict[K, V] = {}
        self._now: dict[K, V] = {}

    def turn(self) -> None:
        """Begin another turn."""
        self._before, self._now = self._now, {}

    def get(self, key: K, make: Callable[[], V]) -> V:
        """Return the value of `key`, made now if it was not asked for lately."""
        if key not in self._now:
            self._now[key] = self._before[key] if key in self._before else make()
        return self._now[key]
