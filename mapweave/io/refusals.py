"""What is refused of a live source, told without a flood: a sensor says forty scans a second."""

from collections.abc import Callable

from mapweave.text import counted


class Refusals:
    """Counts what is refused of a source; tells the first, and then each tenth power.

    Parameters
    ----------
    source
        Whose, such as a topic.
    tell
        Told a line.
    piece
        What is refused.
    """

    def __init__(self, source: str, tell: Callable[[str], None], piece: str = "message") -> None:
        self.count = 0
        self._source = source
        self._tell = tell
        self._piece = piece
        self._next = 1

    def add(self, why: str) -> None:
        """Count one, and why it was refused."""
        self.count += 1
        if self.count < self._next:
            return
        self._next *= 10
        several = f"{counted(self.count, self._piece)} refused, the last"
        what = several if self.count > 1 else f"{self._piece} refused"
        self._tell(f"{self._source}: {what}: {why}")
