"""What the coordinator must not forget: versions, alignments and last maps, in one SQLite file.

Messages are kept as the bytes that travelled; nothing here can read them, and nothing here knows
a clock: times are passed in.
"""

import secrets
import sqlite3
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType
from typing import Any

from mapweave.errors import FileError

APPLICATION_ID = 0x4D505756  # "MPWV", in the file's header (SQLite file format, 1.3.17)
SCHEMA_VERSION = 2
_HEADER_LENGTH = 100
_MAGIC = b"SQLite format 3\0"

_SCHEMA = f"""
BEGIN EXCLUSIVE;
PRAGMA application_id = {APPLICATION_ID};
PRAGMA user_version = {SCHEMA_VERSION};
CREATE TABLE owner (team TEXT NOT NULL, series TEXT NOT NULL);
CREATE TABLE version (
    number INTEGER PRIMARY KEY,
    created REAL NOT NULL,           -- seconds since 1970
    message BLOB NOT NULL);
CREATE TABLE alignment (
    id INTEGER PRIMARY KEY,
    received REAL NOT NULL,
    first TEXT NOT NULL,             -- runs of the pair, in ascending order
    second TEXT NOT NULL,
    message BLOB NOT NULL);
CREATE INDEX alignment_pair ON alignment (first, second);
CREATE TABLE robot_map (
    robot TEXT NOT NULL,
    boot TEXT NOT NULL,              -- of the run
    last_component INTEGER NOT NULL, -- higher for a later run
    received REAL NOT NULL,
    message BLOB NOT NULL,
    PRIMARY KEY (robot, boot));
"""
# What people and programs said; stores of before they could do not have these.
_SAID = (
    """CREATE TABLE IF NOT EXISTS mark (
    robot TEXT NOT NULL,
    boot TEXT NOT NULL,
    received REAL NOT NULL,
    message BLOB NOT NULL,
    PRIMARY KEY (robot, boot))""",
    """CREATE TABLE IF NOT EXISTS operator_order (
    id TEXT PRIMARY KEY,
    received REAL NOT NULL,
    message BLOB NOT NULL)""",
)
_NEWS = " UNION ALL ".join(
    f"SELECT received FROM {table}"
    for table in ("alignment", "robot_map", "mark", "operator_order")
)


class Store:
    """The store of one team; a context manager, usable from several threads.

    Parameters
    ----------
    path
        The file; made when it is missing or empty.
    team
        Whose store it is; a file belongs to one team for good.

    Attributes
    ----------
    series
        Names this store and its numbering: another store counts from 1 again.

    Raises
    ------
    FileError
        If the file is not a store, is damaged, is of another team or schema, or is in use. It is
        left as it was.
    """

    def __init__(self, path: Path, team: str) -> None:
        self.path = path
        self.series: str
        self._lock = threading.Lock()
        fresh = _check_header(path)
        with self._errors_reported():
            self._connection = sqlite3.connect(
                path, timeout=0.0, isolation_level=None, check_same_thread=False
            )
        try:
            self._prepare(team, fresh)
        except FileError:
            self._connection.close()
            raise

    def __enter__(self) -> "Store":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        with self._lock, self._errors_reported():
            self._connection.close()

    @property
    def latest_version(self) -> int:
        """The number of the last version, 0 when there is none."""
        [(number,)] = self._rows("SELECT coalesce(max(number), 0) FROM version")
        return int(number)

    def add_version(self, number: int, created: float, message: bytes) -> None:
        """Keep version `number`, the next one: what was known at `created` [s since 1970]."""
        if number != self.latest_version + 1:
            raise ValueError(f"version {number} does not follow {self.latest_version}")
        self._rows("INSERT INTO version VALUES (?, ?, ?)", number, created, message)

    def version(self, number: int) -> bytes | None:
        """Return the message of version `number`, None when there is none."""
        return self._blob("SELECT message FROM version WHERE number = ?", number)

    def versions_created(self, since: int, limit: int) -> list[tuple[int, float]]:
        """Return number and time [s since 1970] of at most `limit` versions after `since`."""
        sql = "SELECT number, created FROM version WHERE number > ? ORDER BY number LIMIT ?"
        return [(int(number), float(t)) for number, t in self._rows(sql, since, limit)]

    def versions_since(self, number: int) -> Iterator[bytes]:
        """Yield the messages of all versions after `number`, oldest first, one at a time."""
        for wanted in range(max(number, 0) + 1, self.latest_version + 1):
            message = self.version(wanted)
            if message is not None:
                yield message

    def add_alignments(self, pair: tuple[str, str], received: float, message: bytes) -> None:
        """Keep what was found for a pair of runs, beside all that was found before."""
        self._rows(
            "INSERT INTO alignment (received, first, second, message) VALUES (?, ?, ?, ?)",
            received, *sorted(pair), message,
        )  # fmt: skip

    def last_alignments(self) -> list[bytes]:
        """Return the last message of every pair of runs."""
        return self._blobs(
            "SELECT message FROM alignment WHERE id IN"
            " (SELECT max(id) FROM alignment GROUP BY first, second) ORDER BY id"
        )

    def keep_map(
        self, run: tuple[str, str], last_component: int, received: float, message: bytes
    ) -> None:
        """Keep the map of a run, a robot and a boot, in place of the last one of that run."""
        self._rows(
            "INSERT OR REPLACE INTO robot_map VALUES (?, ?, ?, ?, ?)",
            *run, last_component, received, message,
        )  # fmt: skip

    def map_of(self, robot: str) -> bytes | None:
        """Return the map of a robot's last run, None when it was never heard of."""
        return self._blob(
            "SELECT message FROM robot_map WHERE robot = ? ORDER BY last_component DESC LIMIT 1",
            robot,
        )

    def last_maps(self) -> list[bytes]:
        """Return the last map of every run of every robot, also of those that are gone."""
        return self._blobs("SELECT message FROM robot_map ORDER BY robot, last_component")

    def map_with_component(self, robot: str, component: int) -> bytes | None:
        """Return the map of the run that the component of that number is, or was, of.

        A run numbers its components above those of the runs before it.
        """
        return self._blob(
            "SELECT message FROM robot_map WHERE robot = ? AND last_component >= ?"
            " ORDER BY last_component LIMIT 1",
            robot, component,
        )  # fmt: skip

    def keep_marks(self, run: tuple[str, str], received: float, message: bytes) -> None:
        """Keep the marks of a run, a robot and a boot, in place of those kept before."""
        self._rows("INSERT OR REPLACE INTO mark VALUES (?, ?, ?, ?)", *run, received, message)

    def last_marks(self) -> list[bytes]:
        """Return the marks of every run of every robot that made some."""
        return self._blobs("SELECT message FROM mark ORDER BY robot, boot")

    def add_order(self, identity: str, received: float, message: bytes) -> None:
        """Keep an operator's order, once."""
        self._rows(
            "INSERT OR IGNORE INTO operator_order VALUES (?, ?, ?)", identity, received, message
        )

    def orders(self) -> list[bytes]:
        """Return all orders of operators, in the order in which they came."""
        return self._blobs("SELECT message FROM operator_order ORDER BY received, id")

    @property
    def holds_news(self) -> bool:
        """Whether something was received after what the last version was made of."""
        [(received, created)] = self._rows(
            f"SELECT (SELECT max(received) FROM ({_NEWS})), (SELECT max(created) FROM version)"
        )
        return received is not None and (created is None or received > created)

    def _prepare(self, team: str, fresh: bool) -> None:
        # One process owns the file: two coordinators would both number the next version.
        self._rows("PRAGMA locking_mode = EXCLUSIVE")
        if fresh:
            self._create(team)
        elif self._rows("PRAGMA quick_check") != [("ok",)]:
            raise FileError(self.path, "the store is damaged; move it away to begin a new one")
        [(owner, self.series)] = self._rows("SELECT team, series FROM owner")
        if owner != team:
            raise FileError(self.path, f"the store of team {owner!r}, expected team {team!r}")
        for table in _SAID:
            self._rows(table)
        self._rows("PRAGMA journal_mode = WAL")
        self._rows("PRAGMA synchronous = NORMAL")  # in WAL mode a crash still loses no consistency

    def _create(self, team: str) -> None:
        with self._lock, self._errors_reported():
            self._connection.executescript(_SCHEMA)
        self._rows("INSERT INTO owner VALUES (?, ?)", team, secrets.token_hex(6))
        self._rows("COMMIT")

    def _rows(self, sql: str, *values: object) -> list[tuple[Any, ...]]:
        with self._lock, self._errors_reported():
            return self._connection.execute(sql, values).fetchall()

    def _blobs(self, sql: str, *values: object) -> list[bytes]:
        return [bytes(row[0]) for row in self._rows(sql, *values)]

    def _blob(self, sql: str, *values: object) -> bytes | None:
        return next(iter(self._blobs(sql, *values)), None)

    @contextmanager
    def _errors_reported(self) -> Iterator[None]:
        try:
            yield
        except sqlite3.OperationalError as error:
            if "locked" in str(error):
                raise FileError(self.path, "in use by another mapweave server") from error
            raise FileError(self.path, f"the store cannot be used: {error}") from error
        except sqlite3.DatabaseError as error:
            raise FileError(self.path, f"the store is damaged: {error}") from error


def _check_header(path: Path) -> bool:
    """Return whether a new store is to be made at `path`; read, without SQLite touching it.

    SQLite would create journals beside a foreign database, and roll back its pending ones.
    """
    try:
        with path.open("rb") as file:
            header = file.read(_HEADER_LENGTH)
    except FileNotFoundError:
        return True
    except OSError as error:
        raise FileError(path, f"the store cannot be read: {error.strerror}") from error
    if not header:
        return True
    if len(header) < _HEADER_LENGTH or not header.startswith(_MAGIC):
        raise FileError(path, "not a mapweave store: expected an SQLite file")
    if int.from_bytes(header[68:72], "big") != APPLICATION_ID:
        raise FileError(path, "not a mapweave store, but another program's SQLite file")
    if (schema := int.from_bytes(header[60:64], "big")) != SCHEMA_VERSION:
        raise FileError(path, f"a store of schema {schema}, expected {SCHEMA_VERSION}")
    return False
