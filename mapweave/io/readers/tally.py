"""What a file of scans held, for the warning or the error at its end."""

from dataclasses import dataclass, field
from pathlib import Path

from mapweave.io.readers.options import ReadOptions
from mapweave.io.readers.stamps import Stamps
from mapweave.scan.scan import Scan

MOST_ASSUMED = 4  # sentences in a warning: a log of more kinds of scans is not one anybody recorded


@dataclass
class Tally:
    """Counts the pieces of a file as they are read.

    Attributes
    ----------
    piece
        What a scan is one of: a line or a message.
    expected
        What the file should have been, for an error.
    pieces, scans, hits, damaged, foreign
        How many there were: all pieces, scans, beams that came back, damaged pieces, and those of
        them that need not have been a scan.
    cut_off
        Why the file ends before its end; None where it does not.
    """

    piece: str
    expected: str
    pieces: int = 0
    scans: int = 0
    hits: int = 0
    damaged: int = 0
    foreign: int = 0
    cut_off: str | None = None
    _first: str = ""
    _stamps: Stamps = field(default_factory=Stamps)
    _assumed: dict[str, None] = field(default_factory=dict)  # in the order of the file

    def add_scan(self, scan: Scan) -> None:
        """Count a whole scan."""
        self.scans += 1
        self.hits += int(scan.hits.sum())
        self._stamps.add(scan.stamp)

    def add_damaged(self, number: int, error: Exception, *, foreign: bool = False) -> None:
        """Count a damaged piece, the `number`-th of the file."""
        self.damaged += 1
        self.foreign += foreign
        self._first = self._first or f"{self.piece} {number}: {error}"

    def assume(self, what: str) -> None:
        """Note what the file does not say and was assumed; nothing where `what` is empty."""
        if what and len(self._assumed) < MOST_ASSUMED:
            self._assumed[what] = None

    def problem(self) -> str | None:
        """Tell why no scan was usable; None if one was."""
        return None if self.hits else f"{self._why_unusable()}; {self.expected}"

    def warn(self, path: Path | str, options: ReadOptions) -> None:
        """Warn once, if scans are used, of those that were not and of what was assumed."""
        self.assume(self._stamps.assumed)
        found = [f"dropped {self._damage()}"] if self.damaged else []
        if self.cut_off:
            found.append(f"{self.cut_off}: its {self.scans} whole scans were read")
        if self._assumed:
            found.append(f"assumed: {'; '.join(self._assumed)}")
        if self.hits and found:
            options.on_warning(f"{path}: {'; '.join(found)}")

    def _damage(self) -> str:
        pieces = self.piece if self.damaged == 1 else f"{self.piece}s"
        return f"{self.damaged} damaged {pieces}, the first {self._first}"

    def _why_unusable(self) -> str:
        if self.scans:
            return f"no usable scan: in none of its {self.scans} scans did a beam come back"
        if self.damaged > self.foreign:
            return f"no usable scan: {self._damage()}"
        if self.cut_off:
            return f"{self.cut_off}, before the first whole scan"
        return "holds no laser scan" if self.pieces else "is empty"
