"""What a store looks like inside: made whole or not at all, and brought up from earlier forms."""

import os
import secrets
import sqlite3
import zlib
from pathlib import Path

from mapweave.errors import FileError
from mapweave_fusion_server.storage.database import Database

APPLICATION_ID = 0x4D505756  # "MPWV", in the file's header (SQLite file format, 1.3.17)
SCHEMA_VERSION = 3
OLDEST_SCHEMA = 2
MESSAGE_TABLES = ("version", "alignment", "robot_map", "mark", "operator_order")
_HEADER_LENGTH = 100
_MAGIC = b"SQLite format 3\0"

_SAID = (  # by people and programs
    """CREATE TABLE mark (
    robot TEXT NOT NULL,
    boot TEXT NOT NULL,              -- of the run that made them
    received REAL NOT NULL,
    message BLOB NOT NULL,
    checksum INTEGER NOT NULL,
    news INTEGER NOT NULL,
    PRIMARY KEY (robot, boot))""",
    """CREATE TABLE operator_order (
    id TEXT PRIMARY KEY,
    received REAL NOT NULL,
    message BLOB NOT NULL,
    checksum INTEGER NOT NULL,
    news INTEGER NOT NULL)""",
)
_SCHEMA = f"""
PRAGMA application_id = {APPLICATION_ID};
PRAGMA user_version = {SCHEMA_VERSION};
CREATE TABLE owner (
    team TEXT NOT NULL,
    series TEXT NOT NULL,
    inode INTEGER);                  -- of the file; a copy has another
CREATE TABLE version (
    number INTEGER PRIMARY KEY,
    created REAL NOT NULL,           -- seconds since 1970
    message BLOB NOT NULL,
    checksum INTEGER NOT NULL,       -- of the message
    covers INTEGER NOT NULL);        -- the last news that is in it
CREATE TABLE alignment (
    id INTEGER PRIMARY KEY,
    received REAL NOT NULL,
    first TEXT NOT NULL,             -- runs of the pair, in ascending order
    second TEXT NOT NULL,
    message BLOB NOT NULL,
    checksum INTEGER NOT NULL,
    news INTEGER NOT NULL);          -- numbers all that was received, by whatever clock
CREATE INDEX alignment_pair ON alignment (first, second);
CREATE TABLE robot_map (
    robot TEXT NOT NULL,
    boot TEXT NOT NULL,              -- of the run
    last_component INTEGER NOT NULL, -- higher for a later run
    received REAL NOT NULL,
    message BLOB NOT NULL,
    checksum INTEGER NOT NULL,
    news INTEGER NOT NULL,
    PRIMARY KEY (robot, boot));
{";".join(_SAID)};
"""

# What was received up to a time was in the version that was begun then.
_EARLIER = "(SELECT received FROM alignment UNION ALL SELECT received FROM robot_map)"
_FROM_2 = (
    *_SAID,
    "ALTER TABLE owner ADD COLUMN inode INTEGER",
    "ALTER TABLE version ADD COLUMN checksum INTEGER NOT NULL DEFAULT 0",
    "ALTER TABLE version ADD COLUMN covers INTEGER NOT NULL DEFAULT 0",
    "ALTER TABLE alignment ADD COLUMN checksum INTEGER NOT NULL DEFAULT 0",
    "ALTER TABLE alignment ADD COLUMN news INTEGER NOT NULL DEFAULT 0",
    "ALTER TABLE robot_map ADD COLUMN checksum INTEGER NOT NULL DEFAULT 0",
    "ALTER TABLE robot_map ADD COLUMN news INTEGER NOT NULL DEFAULT 0",
    f"UPDATE version SET covers = (SELECT count(*) FROM {_EARLIER} WHERE received <= created)",
    f"UPDATE alignment SET news ="
    f" (SELECT count(*) FROM {_EARLIER} AS e WHERE e.received <= alignment.received)",
    f"UPDATE robot_map SET news ="
    f" (SELECT count(*) FROM {_EARLIER} AS e WHERE e.received <= robot_map.received)",
)  # fmt: skip


def checksum(message: bytes) -> int:
    """Return what tells whether `message` is as it was: SQLite itself does not notice."""
    return zlib.crc32(message)


def is_missing(path: Path) -> bool:
    """Tell whether a new store is to be made at `path`; read, without SQLite touching it.

    SQLite would create journals beside a foreign database, and roll back its pending ones.

    Raises
    ------
    FileError
        If there is something that is no store, or one of a schema unknown here.
    """
    try:
        if path.exists() and not path.is_file():  # a device seems empty, a pipe never ends
            raise FileError(path, "not a file; expected the name of one, for a mapweave store")
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
    if not OLDEST_SCHEMA <= (schema := int.from_bytes(header[60:64], "big")) <= SCHEMA_VERSION:
        whose = "a later" if schema > SCHEMA_VERSION else "an earlier"
        problem = f"a store of schema {schema}, of {whose} mapweave, expected {SCHEMA_VERSION}"
        raise FileError(path, problem)
    return False


def create(path: Path, team: str) -> None:
    """Make an empty store at `path`, where nothing or an empty file is.

    It is there as a whole or not at all, whenever the process ends: it is written beside, and then
    given its name.

    Raises
    ------
    FileError
        If it cannot be written.
    """
    memory = sqlite3.connect(":memory:")
    memory.executescript(_SCHEMA)
    memory.execute("INSERT INTO owner VALUES (?, ?, NULL)", (team, new_series()))
    memory.commit()
    temporary = path.with_name(f".{path.name}.{secrets.token_hex(4)}.new")
    try:
        try:
            _write(temporary, memory.serialize())
            _give_name(temporary, path)
        finally:
            memory.close()
            temporary.unlink(missing_ok=True)
    except OSError as error:
        raise FileError(path, f"the store cannot be written: {error.strerror}") from error


def migrate(database: Database) -> None:
    """Bring a store of an earlier schema up to this one, in one step.

    Raises
    ------
    FileError
        If it is none, or cannot be written.
    """
    [(schema,)] = database.rows("PRAGMA user_version")
    if schema == SCHEMA_VERSION:
        return
    database.define("checksum", checksum)
    with database.transaction(durable=True):
        for statement in _FROM_2:
            database.rows(statement)
        for table in MESSAGE_TABLES:
            database.rows(f"UPDATE {table} SET checksum = checksum(message)")
        database.rows(f"PRAGMA user_version = {SCHEMA_VERSION}")


def new_series() -> str:
    """Return a name for a numbering that nobody has seen."""
    return secrets.token_hex(6)


def _write(path: Path, content: bytes) -> None:
    with path.open("xb") as file:
        file.write(content)
        file.flush()
        os.fsync(file.fileno())


def _give_name(temporary: Path, path: Path) -> None:
    """Give `temporary` its name; a store that another process made meanwhile stays."""
    try:
        os.link(temporary, path)
    except FileExistsError:
        if path.stat().st_size == 0:
            temporary.replace(path)
    except OSError:  # a file system without links
        temporary.replace(path)
    folder = os.open(path.parent, os.O_RDONLY)
    try:
        os.fsync(folder)
    finally:
        os.close(folder)
