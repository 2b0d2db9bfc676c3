"""Rows of what others ask for to have the same: since which version, and in which state."""

from collections.abc import Iterator

from mapweave_fusion_server.storage.database import Database
from mapweave_fusion_server.storage.schema import checksum


def maps_since(database: Database, version: int | None) -> Iterator[tuple[int, str]]:
    """Yield the row and the run of each map, or of those that are not in `version`."""
    rows = database.rows(
        "SELECT rowid, robot, boot FROM robot_map WHERE news > ? ORDER BY robot, last_component",
        _covered_by(database, version),
    )
    return ((number, f"of {robot}@{boot}") for number, robot, boot in rows)


def alignments_since(database: Database, version: int | None) -> Iterator[tuple[int, str]]:
    """Yield the last row of each pair of runs, and which, unless it is in `version`."""
    rows = database.rows(
        "SELECT max(id) AS last, first, second FROM alignment WHERE news > ?"
        " GROUP BY first, second ORDER BY last",
        _covered_by(database, version),
    )
    return ((number, f"of {first} and {second}") for number, first, second in rows)


def renew_alignments(database: Database, pair: tuple[str, str], message: bytes) -> None:
    """Write `message` in place of the last one of its pair.

    Raises
    ------
    UnwritableError
        If there is no room.
    """
    with database.transaction(durable=False):
        database.rows(
            "UPDATE alignment SET message = ?, checksum = ? WHERE id ="
            " (SELECT max(id) FROM alignment WHERE first = ? AND second = ?)",
            message, checksum(message), *sorted(pair),
        )  # fmt: skip


def _covered_by(database: Database, version: int | None) -> int:
    """Return the number of the last that came before `version`; 0 where that is not kept."""
    rows = database.rows("SELECT covers FROM version WHERE number = ?", version or 0)
    return int(rows[0][0]) if rows else 0
