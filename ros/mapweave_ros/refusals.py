"""Messages that are refused, told without a flood: a sensor says forty of them a second."""

from collections.abc import Callable


class Refusals:
    """Counts what is refused of a topic; tells the first, and then each tenth power.

    Parameters
    ----------
    topic
        Whose.
    tell
        Told a line.
    """

    def __init__(self, topic: str, tell: Callable[[str], None]) -> None:
        self.count = 0
        self._topic = topic
        self._tell = tell
        self._next = 1

    def add(self, why: str) -> None:
        """Count one, and why it was refused."""
        self.count += 1
        if self.count < self._next:
            return
        self._next *= 10
        what = f"{self.count} messages refused, the last" if self.count > 1 else "message refused"
        self._tell(f"{self._topic}: {what}: {why}")
