"""An SQLite file whose every trouble is a `FileError` that names it."""

import sqlite3
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

from mapweave.errors import FileError

BUSY = 2.0  # [s] for which a reader of the same file is waited for


class UnwritableError(FileError):
    """A store that cannot be written now, and may be later: the disk is full, say."""


class DamagedError(FileError):
    """A store of which a part cannot be read."""


class Database:
    """An SQLite file; usable from several threads, one at a time.

    Parameters
    ----------
    path
        The file; it must be there.
    read_only
        Whether nothing will be written, whoever else writes meanwhile.

    Raises
    ------
    FileError
        If it cannot be opened.
    """

    def __init__(self, path: Path, *, read_only: bool = False) -> None:
        self.path = path
        self._lock = threading.RLock()
        with self._errors_reported():
            self._connection = self._connect("mode=rw")
        if read_only:
            self._only_read()

    def close(self) -> None:
        """Close it; nothing may be asked of it after."""
        with self._lock, self._errors_reported():
            self._connection.close()

    def rows(self, sql: str, *values: object) -> list[tuple[Any, ...]]:
        """Return the rows that a statement gives.

        Raises
        ------
        FileError
            If that is not possible: `UnwritableError` where it may be later.
        """
        with self._lock, self._errors_reported():
            return self._connection.execute(sql, values).fetchall()

    def define(self, name: str, function: Callable[[Any], int]) -> None:
        """Let statements use `function`, of one argument, by a name."""
        self._connection.create_function(name, 1, function, deterministic=True)

    @contextmanager
    def transaction(self, *, durable: bool) -> Iterator[None]:
        """Do what the block does as a whole, or nothing of it.

        Parameters
        ----------
        durable
            Wait until it is on the disk, with all that was written before: what was told to others
            is there after a loss of power. Otherwise such a loss costs what was last, no more.
        """
        with self._lock:
            self.rows(f"PRAGMA synchronous = {'FULL' if durable else 'NORMAL'}")
            self.rows("BEGIN IMMEDIATE")
            try:
                yield
                self.rows("COMMIT")
            finally:
                if self._connection.in_transaction:
                    self.rows("ROLLBACK")

    def copy_to(self, path: Path) -> None:
        """Write the whole as it is now to the file `path`, while others go on writing."""
        with self._lock, self._errors_reported():
            target = sqlite3.connect(path)
            try:
                self._connection.backup(target)
            finally:
                target.close()

    def _connect(self, how: str) -> sqlite3.Connection:
        connection = sqlite3.connect(
            f"{self.path.resolve().as_uri()}?{how}",
            timeout=BUSY,
            isolation_level=None,
            check_same_thread=False,
            uri=True,
        )
        # A damaged name is another name; by itself it would cost the store.
        connection.text_factory = partial(str, encoding="utf-8", errors="replace")
        return connection

    def _only_read(self) -> None:
        """Write nothing; where nobody can, as on a medium that is read only, not even a journal."""
        with self._errors_reported():
            self._connection.execute("PRAGMA query_only = ON")
            try:
                self._connection.execute("PRAGMA schema_version")
            except sqlite3.OperationalError as error:
                if not error.sqlite_errorname.startswith(("SQLITE_READONLY", "SQLITE_CANTOPEN")):
                    raise
                self._connection.close()
                self._check_no_journal()
                self._connection = self._connect("mode=ro&immutable=1")

    def _check_no_journal(self) -> None:
        journal = self.path.with_name(f"{self.path.name}-wal")
        if journal.exists() and journal.stat().st_size > 0:
            problem = "its journal cannot be read where nothing may be written; copy both elsewhere"
            raise FileError(self.path, problem)

    @contextmanager
    def _errors_reported(self) -> Iterator[None]:
        try:
            yield
        except sqlite3.Error as error:
            raise self._reported(error) from error

    def _reported(self, error: sqlite3.Error) -> FileError:
        name = getattr(error, "sqlite_errorname", None) or ""
        if name.startswith(("SQLITE_BUSY", "SQLITE_LOCKED")):
            return FileError(self.path, "in use by another mapweave server")
        if name.startswith(("SQLITE_FULL", "SQLITE_IOERR", "SQLITE_READONLY")):
            return UnwritableError(self.path, f"the store cannot be written: {error}")
        if name.startswith(("SQLITE_CORRUPT", "SQLITE_NOTADB")):
            return DamagedError(self.path, f"the store is damaged: {error}")
        return FileError(self.path, f"the store cannot be used: {error}")
