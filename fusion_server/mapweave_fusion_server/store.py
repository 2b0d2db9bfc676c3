"""What the coordinator must not forget: versions, alignments and last maps, in one SQLite file.

Messages are kept as the bytes that travelled; nothing here can read them, and nothing here knows
a clock: times are passed in.
"""

import logging
import os
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from types import TracebackType

from mapweave.errors import FileError
from mapweave_fusion_server.storage.database import DamagedError, Database, UnwritableError
from mapweave_fusion_server.storage.held import Held
from mapweave_fusion_server.storage.ownership import own
from mapweave_fusion_server.storage.replicas import (
    alignments_since,
    maps_since,
    renew_alignments,
)
from mapweave_fusion_server.storage.retention import Retention
from mapweave_fusion_server.storage.rows import Row, VersionRow, drop_versions
from mapweave_fusion_server.storage.salvage import is_sound, salvage
from mapweave_fusion_server.storage.schema import checksum, create, is_missing, migrate, new_series

_log = logging.getLogger(__name__)


class Store:
    """The store of one team; a context manager, usable from several threads.

    A version is on the disk when `add_version` returns, whatever becomes of the machine. Where the
    disk is full, what comes is held, and written when there is room again (`resume`).

    Parameters
    ----------
    path
        The file; made when it is missing or empty.
    team
        Whose store it is; a file belongs to one team for good.
    retention
        How much of the past is kept.

    Raises
    ------
    FileError
        If the file is not a store, cannot be read at all, is of another team or schema, or is in
        use. It is left as it was.
    """

    def __init__(self, path: Path, team: str, retention: Retention | None = None) -> None:
        self.path = path
        self._retention = retention or Retention()
        self._held = Held()
        self._damage: set[str] = set()
        if is_missing(path):
            create(path, team)
        self._owned = own(path)
        try:
            self._database = self._open(team)
        except FileError:
            os.close(self._owned)
            raise

    def __enter__(self) -> "Store":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.resume()
        try:
            self._database.close()
        finally:
            os.close(self._owned)

    @property
    def series(self) -> str:
        """Names this store and its numbering: another store counts from 1 again."""
        return self._held.series or self._series

    @property
    def is_storing(self) -> bool:
        """Whether what comes is written, and does not wait for room."""
        return not self._held

    @property
    def damaged(self) -> int:
        """How many rows could not be read; each was logged."""
        return len(self._damage)

    @property
    def news(self) -> int:
        """The number of the last message that was kept, versions apart."""
        return self._news

    @property
    def oldest_version(self) -> int:
        """The number of the first version that is still kept, 0 when there is none."""
        [(number,)] = self._database.rows("SELECT coalesce(min(number), 0) FROM version")
        return int(number) or min(self._held.versions, default=0)

    @property
    def latest_version(self) -> int:
        """The number of the last version, 0 when there is none."""
        [(number,)] = self._database.rows("SELECT coalesce(max(number), 0) FROM version")
        return max(int(number), *self._held.versions, 0)

    def add_version(
        self, number: int, created: float, message: bytes, covers: int | None = None
    ) -> None:
        """Keep version `number`, the next one: what was known at `created` [s since 1970].

        Parameters
        ----------
        covers
            `news` as it was then; as it is now unless told.

        Raises
        ------
        UnwritableError
            If it cannot be written now, and `hold` was not called.
        """
        if number != self.latest_version + 1:
            raise ValueError(f"version {number} does not follow {self.latest_version}")
        version = VersionRow(number, created, message, self._news if covers is None else covers)
        if self._held.series is not None:
            # With what waits: where there is room for that alone, there may be none for this.
            self._held.add_version(version)
            self.resume()
            return
        if not self.resume():
            raise UnwritableError(self.path, "the store cannot be written")
        with self._database.transaction(durable=True):
            version.insert(self._database)
            drop_versions(self._database, self._retention, number, created)

    def hold(self) -> None:
        """Let versions wait in memory where they cannot be written, in a series of their own.

        If the process ends before there is room, they are lost, and the store goes on with the
        numbers that they had: by the series, others can tell them apart.
        """
        self._held.series = new_series()

    def resume(self) -> bool:
        """Write what waits, if there is room; return whether nothing waits any more."""
        if not self._held:
            return True
        try:
            with self._database.transaction(durable=True):
                self._write_held()
        except UnwritableError:
            return False
        self._series, self._held = self.series, Held()
        return True

    def version(self, number: int) -> bytes | None:
        """Return the message of version `number`, None when there is none that can be read."""
        if number in self._held.versions:
            return self._held.versions[number].message
        return self._message("version", number, f"version {number}")

    def versions_created(self, since: int, limit: int) -> list[tuple[int, float]]:
        """Return number and time [s since 1970] of at most `limit` versions after `since`."""
        sql = "SELECT number, created FROM version WHERE number > ? ORDER BY number LIMIT ?"
        stored = [(int(n), float(t)) for n, t in self._database.rows(sql, since, limit)]
        held = [(v.number, v.created) for v in self._held.versions.values() if v.number > since]
        return [*stored, *held][:limit]

    def versions_since(self, number: int) -> Iterator[bytes]:
        """Yield the messages of all versions after `number`, oldest first, one at a time."""
        sql = "SELECT number FROM version WHERE number > ? ORDER BY number"
        stored = [int(wanted) for (wanted,) in self._database.rows(sql, number)]
        held = [wanted for wanted in self._held.versions if wanted > number]
        for wanted in (*stored, *held):
            message = self.version(wanted)
            if message is not None:
                yield message

    def add_alignments(self, pair: tuple[str, str], received: float, message: bytes) -> None:
        """Keep what was found for a pair of runs, beside what was found before."""
        first, second = sorted(pair)
        self._keep((first, second), "alignment", (None, received, first, second), message)

    def renew_alignments(self, pair: tuple[str, str], message: bytes) -> None:
        """Keep `message` in place of the last one of its pair, of which it says the same."""
        try:
            renew_alignments(self._database, pair, message)
        except UnwritableError as error:
            _log.warning("%s; what was found before stays", error)

    def last_alignments(self) -> list[bytes]:
        """Return the last message of every pair of runs, as far as it can be read."""
        numbers = self._database.rows(
            "SELECT max(id) AS last, first, second FROM alignment GROUP BY first, second"
            " ORDER BY last"
        )
        return self._messages("alignment", ((n, f"of {a} and {b}") for n, a, b in numbers))

    def keep_map(
        self, run: tuple[str, str], last_component: int, received: float, message: bytes
    ) -> None:
        """Keep the map of a run, a robot and a boot, in place of the last one of that run."""
        self._keep(run, "robot_map", (*run, last_component, received), message)

    def map_of(self, robot: str, boot: str | None = None) -> bytes | None:
        """Return the map of a robot's run, by default its last; None when it was not heard of."""
        rows = self._database.rows(
            "SELECT rowid, last_component FROM robot_map WHERE robot = ?1"
            " AND boot = coalesce(?2, boot) ORDER BY last_component DESC",
            robot, boot,
        )  # fmt: skip
        waiting = [
            row
            for row in self._held.of("robot_map")
            if row.values[0] == robot and boot in (None, row.values[1])
        ]
        held = {int(str(row.values[2])): row.message for row in waiting}
        last = max(held, default=-1)
        for number, component in rows:
            if component <= last:
                break
            message = self._message("robot_map", number, f"the map of {robot}")
            if message is not None:
                return message
        return held.get(last)

    def last_maps(self) -> list[bytes]:
        """Return the last map of every run of every robot, also of those that are gone."""
        numbers = self._database.rows(
            "SELECT rowid, robot, boot FROM robot_map ORDER BY robot, last_component"
        )
        return self._messages("robot_map", ((n, f"of {r}@{b}") for n, r, b in numbers))

    def maps_since(self, version: int | None) -> list[bytes]:
        """Return the maps of all runs, or those that are not in `version`."""
        return self._messages("robot_map", maps_since(self._database, version))

    def alignments_since(self, version: int | None) -> list[bytes]:
        """Return the last message of every pair of runs, unless it is in `version`."""
        return self._messages("alignment", alignments_since(self._database, version))

    def map_with_component(self, robot: str, component: int) -> bytes | None:
        """Return the map of the run that the component of that number is, or was, of.

        A run numbers its components above those of the runs before it; where it could not, `robot`
        names its boot as well.
        """
        robot, _, boot = robot.partition("@")
        numbers = self._database.rows(
            "SELECT rowid FROM robot_map WHERE robot = ? AND ? IN ('', boot)"
            " AND last_component >= ? ORDER BY last_component LIMIT 1",
            robot, boot, component,
        )  # fmt: skip
        return next(
            iter(self._messages("robot_map", ((n, f"of {robot}") for (n,) in numbers))), None
        )

    def runs(self) -> list[tuple[str, str, int]]:
        """Return robot, boot and last component of every run, those of a robot from its first."""
        columns = "robot, boot, last_component"
        return self._database.rows(
            f"SELECT {columns} FROM robot_map ORDER BY robot, last_component"
        )

    def keep_marks(self, run: tuple[str, str], received: float, message: bytes) -> None:
        """Keep the marks of a run, a robot and a boot, in place of those kept before."""
        self._keep(run, "mark", (*run, received), message)

    def last_marks(self) -> list[bytes]:
        """Return the marks of every run of every robot that made some."""
        numbers = self._database.rows("SELECT rowid, robot, boot FROM mark ORDER BY robot, boot")
        return self._messages("mark", ((n, f"of {r}@{b}") for n, r, b in numbers))

    def add_order(self, identity: str, received: float, message: bytes) -> None:
        """Keep an operator's order, once."""
        self._keep(("order", identity), "operator_order", (identity, received), message)

    def orders(self) -> list[bytes]:
        """Return all orders of operators, in the order in which they came."""
        numbers = self._database.rows("SELECT rowid, id FROM operator_order ORDER BY news")
        return self._messages("operator_order", ((n, i) for n, i in numbers))

    @property
    def holds_news(self) -> bool:
        """Whether something was received that is not in the last version."""
        [(covers,)] = self._database.rows("SELECT coalesce(max(covers), 0) FROM version")
        return self._news > int(covers)

    def _keep(
        self, of: tuple[str, str], table: str, values: tuple[object, ...], message: bytes
    ) -> None:
        """Write what came, or let it wait for room; of the same thing the last one counts."""
        self._news += 1
        row = Row(table, values, message, self._news)
        if not self._held:
            try:
                with self._database.transaction(durable=False):
                    row.insert(self._database)
            except UnwritableError as error:
                _log.warning("%s; what comes waits for room", error)
            else:
                return
        self._held.rows[table, *of] = row

    def _write_held(self) -> None:
        self._database.rows("UPDATE owner SET series = ?", self.series)
        for version in self._held.versions.values():
            version.insert(self._database)
        for row in self._held.rows.values():
            row.insert(self._database)

    def _open(self, team: str) -> Database:
        database = Database(self.path)
        try:
            if not is_sound(database):
                salvage(database, self.path, team)
                database, damaged = Database(self.path), self._owned
                self._owned = own(self.path)
                os.close(damaged)
            migrate(database)
            self._take_over(database, team)
            database.rows("PRAGMA journal_mode = WAL")  # a crash loses no consistency
        except FileError:
            database.close()
            raise
        return database

    def _take_over(self, database: Database, team: str) -> None:
        """Read whose store it is; begin a new series where this is a copy of another file.

        Where a copy is put in the place of a store, versions may have been published that it does
        not have: their numbers must not be given again.
        """
        owners = database.rows("SELECT team, series, inode FROM owner")
        if not owners:
            _log.warning("%s: damaged, its owner is not known; a new series begins", self.path)
        owner, self._series, inode = owners[0] if owners else (team, new_series(), None)
        self._series = str(self._series)
        if owner != team:
            raise FileError(self.path, f"the store of team {owner!r}, expected team {team!r}")
        here = self.path.stat().st_ino
        if inode not in (None, here):
            self._series = new_series()
            _log.warning("%s: a copy; a new series begins", self.path)
        if inode != here:
            with database.transaction(durable=True):
                database.rows("DELETE FROM owner")
                database.rows("INSERT INTO owner VALUES (?, ?, ?)", team, self._series, here)
        [(news,)] = database.rows(
            "SELECT max((SELECT coalesce(max(covers), 0) FROM version),"
            " (SELECT coalesce(max(news), 0) FROM alignment),"
            " (SELECT coalesce(max(news), 0) FROM robot_map),"
            " (SELECT coalesce(max(news), 0) FROM mark),"
            " (SELECT coalesce(max(news), 0) FROM operator_order))"
        )
        self._news = int(news)

    def _messages(self, table: str, rows: Iterator[tuple[int, str]]) -> list[bytes]:
        found = [self._message(table, number, f"{table} {what}") for number, what in rows]
        return [message for message in found if message is not None]

    def _message(self, table: str, number: int, what: str) -> bytes | None:
        """Return the message of a row, None if there is no such row or it is damaged."""
        rows = None
        with suppress(DamagedError):
            rows = self._database.rows(
                f"SELECT message, checksum FROM {table} WHERE rowid = ?", number
            )
        if rows == []:
            return None
        message, expected = rows[0] if rows else (None, None)
        if isinstance(message, bytes) and checksum(message) == expected:
            return message
        if what not in self._damage:
            self._damage.add(what)
            _log.warning("%s: damaged: %s is left out", self.path, what)
        return None
