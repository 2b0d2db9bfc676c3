"""A few values that took time to make, each made once."""

import threading
from collections import OrderedDict
from collections.abc import Callable
from typing import Generic, TypeVar

T = TypeVar("T")


class Recent(Generic[T]):
    """Values by number, made when they are first asked for; usable from several threads.

    Who asks for what another is making waits for it.

    Parameters
    ----------
    make
        Makes the value of a number; None, of which nothing is kept, where there is none.
    limit
        How many are kept: those that were asked for last.
    """

    def __init__(self, make: Callable[[int], T | None], limit: int) -> None:
        self._make = make
        self._limit = limit
        self._values: OrderedDict[int, T] = OrderedDict()
        self._guard = threading.Lock()

    def get(self, number: int) -> T | None:
        """Return the value of `number`, None where there is none."""
        with self._guard:
            value = self._values.get(number)
            if value is None:
                value = self._make(number)
            if value is not None:
                self._keep(number, value)
            return value

    def put(self, number: int, value: T) -> None:
        """Keep what is the value of `number`, which spares making it."""
        with self._guard:
            self._keep(number, value)

    def _keep(self, number: int, value: T) -> None:
        self._values[number] = value
        self._values.move_to_end(number)
        while len(self._values) > self._limit:
            self._values.popitem(last=False)
