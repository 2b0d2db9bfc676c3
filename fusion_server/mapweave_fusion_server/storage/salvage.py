"""What can still be read of a damaged store, in a new one beside it."""

import logging
import secrets
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

from mapweave.errors import FileError
from mapweave_fusion_server.storage.database import DamagedError, Database
from mapweave_fusion_server.storage.schema import (
    MESSAGE_TABLES,
    SCHEMA_VERSION,
    checksum,
    create,
)

COLUMNS = {
    "version": "number, created, message, checksum, covers",
    "alignment": "id, received, first, second, message, checksum, news",
    "robot_map": "robot, boot, last_component, received, message, checksum, news",
    "mark": "robot, boot, received, message, checksum, news",
    "operator_order": "id, received, message, checksum, news",
}
INDEXED = tuple(table for table in MESSAGE_TABLES if table != "version")
TYPES: dict[str, tuple[type, ...]] = {  # of columns; of all others, which are numbers, integer
    "created": (int, float),
    "received": (int, float),
    "message": (bytes,),
    **dict.fromkeys(("first", "second", "robot", "boot"), (str,)),
}
PROBED = 20_000  # rows tried one by one between those that can be reached from either end

_log = logging.getLogger(__name__)


def is_sound(database: Database) -> bool:
    """Tell whether the structure of the file is whole, and all that is beside the messages.

    Messages are compared with their checksums where they are read, each for itself.
    """
    try:
        if database.rows("PRAGMA quick_check(1)") != [("ok",)]:
            return False
        if database.rows("PRAGMA user_version") != [(SCHEMA_VERSION,)]:
            return True  # it has other tables until it is brought up
        checks = [database.rows(f"PRAGMA integrity_check({table})") for table in INDEXED]
        if any(check != [("ok",)] for check in checks):
            return False
        return not any(map(partial(_has_what_it_cannot_be, database), MESSAGE_TABLES))
    except DamagedError:
        return False


def _has_what_it_cannot_be(database: Database, table: str) -> bool:
    """Tell whether something beside a message of `table` is of another kind than it can be."""
    names = {int: "integer", float: "real", str: "text"}
    wrong = [
        f"typeof({column}) NOT IN ({', '.join(repr(names[kind]) for kind in kinds)})"
        for column, kinds in _types_of(table).items()
        if kinds != TYPES["message"]  # that costs the row alone
    ]
    return bool(database.rows(f"SELECT 1 FROM {table} WHERE {' OR '.join(wrong)} LIMIT 1"))


def _types_of(table: str) -> dict[str, tuple[type, ...]]:
    kinds = {column: TYPES.get(column, (int,)) for column in COLUMNS[table].split(", ")}
    return kinds | ({"id": (str,)} if table == "operator_order" else {})


def salvage(damaged: Database, path: Path, team: str) -> Path:
    """Put a new store in the place of a damaged one, with every row that can still be read.

    It has a series of its own, as the last versions may be among those that are lost. The damaged
    file is kept beside it, as it was.

    Parameters
    ----------
    damaged
        Open on `path`; it is closed.

    Returns
    -------
    Path
        Where the damaged file is now.

    Raises
    ------
    FileError
        If nothing at all can be read; then all is left as it was.
    """
    beside = path.with_name(f".{path.name}.{secrets.token_hex(4)}.new")
    try:
        if not _is_readable(damaged):
            raise FileError(path, "the store is damaged; move it away to begin a new one")
        create(beside, team)
        counts = _copy(damaged, beside)
        damaged.close()
        away = path.with_name(f"{path.name}.damaged-{secrets.token_hex(4)}")
        for ending in ("", "-wal"):
            journal = path.with_name(path.name + ending)
            if journal.exists():
                journal.rename(away.with_name(away.name + ending))
        beside.rename(path)
    except OSError as error:
        raise FileError(path, f"damaged, and cannot be replaced ({error.strerror})") from error
    finally:
        beside.unlink(missing_ok=True)
    told = ", ".join(f"{count} of {table}" for table, count in counts.items())
    _log.warning("%s: damaged; read of it: %s; the damaged file is %s now", path, told, away)
    return away


def _is_readable(damaged: Database) -> bool:
    # Else SQLite opens nothing of a file that is shorter than its first page says; only read here.
    damaged.rows("PRAGMA writable_schema = ON")
    try:
        tables = {name for (name,) in damaged.rows("SELECT name FROM sqlite_master")}
    except DamagedError:
        return False
    return tables.issuperset(MESSAGE_TABLES)


def _copy(damaged: Database, target: Path) -> dict[str, int]:
    """Copy what is whole; return how many rows of each table."""
    counts = dict.fromkeys(MESSAGE_TABLES, 0)
    database = Database(target)
    try:
        with database.transaction(durable=True):
            for table in MESSAGE_TABLES:
                for row in _rows(damaged, table):
                    places = ", ".join("?" * len(row))
                    database.rows(f"INSERT OR REPLACE INTO {table} VALUES ({places})", *row)
                    counts[table] += 1
    finally:
        database.close()
    return counts


def _rows(damaged: Database, table: str) -> Iterator[tuple[Any, ...]]:
    """Yield the rows that are whole: from either end, and one by one between."""
    last_up = last_down = None
    for number, row in _walk(damaged, table, "ASC"):
        last_up = number
        yield from _whole(table, row)
    for number, row in _walk(damaged, table, "DESC"):
        if last_up is not None and number <= last_up:
            return
        last_down = number
        yield from _whole(table, row)
    first = 1 if last_up is None else last_up + 1
    last = first + PROBED if last_down is None else last_down
    for number in range(first, min(last, first + PROBED)):
        try:
            found = damaged.rows(f"SELECT {COLUMNS[table]} FROM {table} WHERE rowid = ?", number)
        except DamagedError:
            continue
        for row in found:
            yield from _whole(table, row)


def _walk(damaged: Database, table: str, order: str) -> Iterator[tuple[int, tuple[Any, ...]]]:
    """Yield number and content of the rows from one end, up to where that is damaged."""
    beyond, sign = (-1, ">") if order == "ASC" else (2**62, "<")
    while True:
        try:
            found = damaged.rows(
                f"SELECT rowid, {COLUMNS[table]} FROM {table} WHERE rowid {sign} ?"
                f" ORDER BY rowid {order} LIMIT 1",
                beyond,
            )
        except DamagedError:
            return
        # Behind a damaged page a row may come again that was there before.
        if not found or (found[0][0] > beyond) != (order == "ASC"):
            return
        beyond = found[0][0]
        yield beyond, found[0][1:]


def _whole(table: str, row: tuple[Any, ...]) -> Iterator[tuple[Any, ...]]:
    kinds = _types_of(table)
    if not all(isinstance(value, kind) for value, kind in zip(row, kinds.values(), strict=True)):
        return
    values = dict(zip(kinds, row, strict=True))
    if checksum(values["message"]) == values["checksum"]:
        yield row
