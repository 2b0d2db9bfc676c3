"""The raw scans of a run's beginning: kept as long as all of it may be mapped once more."""

from mapweave.scan.scan import Scan


class RawScans:
    """Keeps all scans of a run, or none: what lies in between could be tracked from nothing.

    Parameters
    ----------
    most
        How many are kept; a run that has more keeps none any more.

    Attributes
    ----------
    are_whole
        Whether all scans so far are kept.
    """

    def __init__(self, most: int) -> None:
        self._most = most
        self._scans: list[Scan] = []
        self.are_whole = True

    def add(self, scan: Scan) -> None:
        """Take the next scan."""
        if not self.are_whole:
            return
        self._scans.append(scan)
        if len(self._scans) > self._most:
            self._scans, self.are_whole = [], False

    def take(self) -> list[Scan]:
        """Return all scans so far, in order, and keep none: they are to be added again."""
        scans, self._scans = self._scans, []
        return scans
