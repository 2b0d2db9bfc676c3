"""A range of the scans of a log, as ``--scans A:B`` names it."""

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import islice

from mapweave.scan.scan import Scan

_RANGE = re.compile(r"([0-9]{0,9}):([0-9]{0,9})")


@dataclass(frozen=True, slots=True)
class ScanRange:
    """Which scans of a log: from `first`, up to before `end`; None is to the last."""

    first: int = 0
    end: int | None = None

    @classmethod
    def parse(cls, text: str) -> "ScanRange":
        """Return the range that ``A:B`` says; either may be left out.

        Raises
        ------
        ValueError
            If it is none, or an empty one.
        """
        match = _RANGE.fullmatch(text)
        first = int(match[1] or 0) if match else 0
        end = int(match[2]) if match and match[2] else None
        if match is None or (end is not None and end <= first):
            raise ValueError(f"{text!r}: expected A:B, the first scan and the one after the last")
        return cls(first, end)

    def of(self, scans: Iterable[Scan]) -> Iterator[Scan]:
        """Yield those of `scans`, a whole log's, that it selects."""
        return islice(scans, self.first, self.end)

    def count(self, scans: int) -> int:
        """Return how many of a log of `scans` scans it selects."""
        end = scans if self.end is None else min(self.end, scans)
        return max(0, end - self.first)

    def __str__(self) -> str:
        return f"{self.first}:{'' if self.end is None else self.end}"
