"""A store that is looked at, by another process than the coordinator, which may go on."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType

from mapweave.atomic import replace_file
from mapweave.errors import FileError
from mapweave_fusion_server.storage.database import DamagedError, Database, UnwritableError
from mapweave_fusion_server.storage.salvage import is_sound
from mapweave_fusion_server.storage.schema import (
    MESSAGE_TABLES,
    SCHEMA_VERSION,
    checksum,
    is_missing,
)

NO_FILE = 0
"""The inode in a copy that no coordinator has opened."""


@dataclass(frozen=True, slots=True)
class VersionEntry:
    """A version: its number, when it was begun [s since 1970; None if damaged], and its bytes."""

    number: int
    created: float | None
    size: int


class StoreView:
    """A store, read only; a context manager.

    Parameters
    ----------
    path
        The file.
    team
        Whose store is expected; anybody's if None.

    Raises
    ------
    FileError
        If it is not a store, one of another schema, or another team's.
    """

    def __init__(self, path: Path, team: str | None = None) -> None:
        self.path = path
        if is_missing(path):
            raise FileError(path, "no store here; expected the file that mapweave server keeps")
        self._database = Database(path, read_only=True)
        try:
            self._check_schema()
            self._check_owner(team)
        except FileError:
            self._database.close()
            raise

    def __enter__(self) -> "StoreView":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._database.close()

    @property
    def numbers(self) -> tuple[int, int]:
        """The first and the last version, 0 and 0 when there is none."""
        [(first, last)] = self._database.rows("SELECT min(number), max(number) FROM version")
        return int(first or 0), int(last or 0)

    def versions(self, limit: int) -> list[VersionEntry]:
        """Return the last `limit` versions, ascending."""
        rows = self._database.rows(
            "SELECT number, created, length(message) FROM version ORDER BY number DESC LIMIT ?",
            limit,
        )
        return [VersionEntry(int(n), _time(t), int(size or 0)) for n, t, size in reversed(rows)]

    def version(self, number: int) -> bytes:
        """Return the message of version `number`.

        Raises
        ------
        FileError
            If there is none, or it is damaged.
        """
        message = self._message("version", number)
        if message is None:
            first, last = self.numbers
            there = f"there are {first} to {last}" if last else "there is none yet"
            raise FileError(self.path, f"no version {number} of the joint map; {there}")
        return message

    def problems(self) -> Iterator[str]:
        """Yield what is wrong with the file; messages are compared with their checksums."""
        if not is_sound(self._database):
            yield "the structure of the file is damaged: the server saves what it can when it opens"
            return
        for table in MESSAGE_TABLES:
            for (row,) in self._database.rows(f"SELECT rowid FROM {table}"):
                try:
                    self._message(table, row)
                except FileError as error:
                    yield error.problem

    def messages(self, table: str) -> Iterator[tuple[int, bytes]]:
        """Yield row number and message of all rows of `table` that are whole."""
        for (row,) in self._database.rows(f"SELECT rowid FROM {table}"):
            try:
                message = self._message(table, row)
            except FileError:
                continue  # told by `problems`
            if message is not None:
                yield row, message

    def backup(self, path: Path) -> None:
        """Write a copy of the store as it is now to `path`, whole or not at all.

        Raises
        ------
        FileError
            If it cannot be written, or something else than an earlier copy is there.
        """
        if not _may_be_replaced(path):
            problem = "is no backup of a store, and would be overwritten; expected another name"
            raise FileError(path, problem)
        with replace_file(path) as temporary:
            try:
                self._database.copy_to(temporary)
            except UnwritableError as error:
                raise FileError(path, f"cannot be written: {error.__cause__}") from error
            copy = Database(temporary)
            try:
                # No file has it, so who opens the copy begins a new series.
                copy.rows(f"UPDATE owner SET inode = {NO_FILE}")
                copy.rows("PRAGMA journal_mode = DELETE")
            finally:
                copy.close()

    def _message(self, table: str, row: int) -> bytes | None:
        try:
            rows = self._database.rows(
                f"SELECT message, checksum FROM {table} WHERE rowid = ?", row
            )
        except DamagedError as error:
            raise FileError(self.path, f"row {row} of {table} is damaged") from error
        if not rows:
            return None
        message, expected = rows[0]
        if not isinstance(message, bytes) or checksum(message) != expected:
            raise FileError(self.path, f"row {row} of {table} is damaged")
        return message

    def _check_schema(self) -> None:
        [(schema,)] = self._database.rows("PRAGMA user_version")
        if schema != SCHEMA_VERSION:
            problem = f"a store of schema {schema}, expected {SCHEMA_VERSION}"
            raise FileError(self.path, f"{problem}: the server brings it up when it opens it")

    def _check_owner(self, team: str | None) -> None:
        owners = {str(owner) for (owner,) in self._database.rows("SELECT team FROM owner")}
        if team is not None and owners and team not in owners:
            problem = f"the store of team {', '.join(owners)!r}, expected team {team!r}"
            raise FileError(self.path, problem)


def _time(value: object) -> float | None:
    return float(value) if isinstance(value, int | float) and math.isfinite(value) else None


def _may_be_replaced(path: Path) -> bool:
    """Tell whether there is nothing, or a backup with which no coordinator has gone on."""
    try:
        if is_missing(path):
            return True
        database = Database(path, read_only=True)
        try:
            return database.rows("SELECT inode FROM owner") == [(NO_FILE,)]
        finally:
            database.close()
    except FileError:
        return False
