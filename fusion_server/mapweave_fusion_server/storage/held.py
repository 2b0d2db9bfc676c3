"""What could not be written yet: the disk is full, and the team goes on."""

from collections.abc import Hashable
from dataclasses import dataclass, field

from mapweave_fusion_server.storage.rows import Row, VersionRow

MOST_VERSIONS = 16  # kept of those that wait; the latest is what counts


@dataclass
class Held:
    """What waits for room, bounded: of each thing the last, of versions a few.

    Attributes
    ----------
    series
        Names the numbering of these versions. Those that are only here may be lost with the
        process, so their numbers must not be taken for those of the store.
    rows
        By what they are of.
    """

    series: str | None = None
    versions: dict[int, VersionRow] = field(default_factory=dict)
    rows: dict[Hashable, Row] = field(default_factory=dict)

    def __bool__(self) -> bool:
        return bool(self.series or self.versions or self.rows)

    def add_version(self, version: VersionRow) -> None:
        """Hold `version`; of too many the oldest goes."""
        self.versions[version.number] = version
        if len(self.versions) > MOST_VERSIONS:
            del self.versions[min(self.versions)]

    def of(self, table: str) -> list[Row]:
        """Return the rows of a table."""
        return [row for row in self.rows.values() if row.table == table]
