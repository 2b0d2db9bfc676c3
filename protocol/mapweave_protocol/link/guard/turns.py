"""Whose turn it is: of several senders, the one that has taken least time so far."""

from collections.abc import Iterable

LEAST = 1e-3  # [s] that a turn counts at least
REMEMBERED = 256  # senders; names come from the network


class Turns:
    """Shares time among senders, however much each sends and whatever it costs to read it.

    Who comes, or comes back, begins where the others are: nobody saves up for a burst.
    """

    def __init__(self) -> None:
        self._spent: dict[str, float] = {}  # [s]
        self._level = 0.0  # of the one that had the last turn

    def joins(self, sender: str) -> None:
        """Note that something of `sender` waits, of which nothing did before."""
        self._spent[sender] = max(self._spent.pop(sender, 0.0), self._level)

    def next_of(self, waiting: Iterable[str]) -> str:
        """Return who of those that wait is next, and count the turn."""
        sender = min(waiting, key=lambda one: self._spent.get(one, 0.0))
        self._level = self._spent.get(sender, 0.0)
        self._spent[sender] = self._level + LEAST
        return sender

    def took(self, sender: str, seconds: float) -> None:
        """Count what the last turn of `sender` took."""
        self._spent[sender] = self._spent.get(sender, 0.0) + max(0.0, seconds - LEAST)
        while len(self._spent) > REMEMBERED:
            del self._spent[next(iter(self._spent))]
