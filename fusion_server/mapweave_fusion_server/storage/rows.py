"""Rows of the tables, and how they are written; within a transaction of the caller's."""

from dataclasses import dataclass

from mapweave_fusion_server.storage.database import Database
from mapweave_fusion_server.storage.retention import ALIGNMENTS_OF_A_PAIR, Retention
from mapweave_fusion_server.storage.schema import checksum


@dataclass(frozen=True, slots=True)
class Row:
    """A message that came, in any table but that of versions.

    Attributes
    ----------
    table
        Its name.
    values
        Of the columns before `message`.
    news
        Numbers all that came.
    """

    table: str
    values: tuple[object, ...]
    message: bytes
    news: int

    def insert(self, database: Database) -> None:
        """Write it, in place of that with the same key."""
        columns = (*self.values, self.message, checksum(self.message), self.news)
        places = ", ".join("?" * len(columns))
        database.rows(f"INSERT OR REPLACE INTO {self.table} VALUES ({places})", *columns)
        if self.table == "alignment":
            _drop_alignments(database, *self.values[2:])


@dataclass(frozen=True, slots=True)
class VersionRow:
    """A version: its number, and the last news that it covers."""

    number: int
    created: float
    message: bytes
    covers: int

    def insert(self, database: Database) -> None:
        """Write it."""
        database.rows(
            "INSERT INTO version VALUES (?, ?, ?, ?, ?)",
            self.number, self.created, self.message, checksum(self.message), self.covers,
        )  # fmt: skip


def drop_versions(database: Database, retention: Retention, latest: int, now: float) -> None:
    """Delete the versions that need not be kept; the latest always is."""
    number, created = retention.oldest_kept(latest, now)
    database.rows(
        "DELETE FROM version WHERE number < ? AND (number < ? OR created < ?)",
        latest, number, created,
    )  # fmt: skip


def _drop_alignments(database: Database, first: object, second: object) -> None:
    """Delete what was found for a pair of runs long ago."""
    database.rows(
        "DELETE FROM alignment WHERE first = ? AND second = ? AND id NOT IN (SELECT id FROM"
        " alignment WHERE first = ? AND second = ? ORDER BY id DESC LIMIT ?)",
        first, second, first, second, ALIGNMENTS_OF_A_PAIR,
    )  # fmt: skip
