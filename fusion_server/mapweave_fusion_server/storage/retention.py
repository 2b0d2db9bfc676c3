"""How much of the past a store keeps."""

import math
from dataclasses import dataclass

DEFAULT_VERSIONS = 10_000  # some 5 h of a version every 2 s, a few 100 MB
ALIGNMENTS_OF_A_PAIR = 16  # of which the last one counts
DAY = 86_400.0  # [s]


@dataclass(frozen=True, slots=True)
class Retention:
    """What is dropped when a version is added; the latest never is.

    Attributes
    ----------
    versions
        The most that are kept.
    age
        Older ones are dropped [s].
    """

    versions: int = DEFAULT_VERSIONS
    age: float = math.inf

    def oldest_kept(self, latest: int, now: float) -> tuple[int, float]:
        """Return the lowest number that is kept, and the earliest time [s since 1970]."""
        return latest - self.versions + 1, now - self.age
