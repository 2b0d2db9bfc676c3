"""Where a team's results go: one team at a time."""

import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from mapweave.errors import FileError


@dataclass(frozen=True, slots=True)
class OutputFolder:
    """What is where in the output folder."""

    path: Path

    @property
    def joint(self) -> Path:
        """The joint map."""
        return self.path / "joint.json"

    @property
    def picture(self) -> Path:
        """Its picture."""
        return self.path / "joint.png"

    @property
    def store(self) -> Path:
        """The coordinator's store."""
        return self.path / "store.sqlite"

    @property
    def joint_so_far(self) -> Path:
        """The joint map of a team that was stopped; that of an earlier one stays."""
        return self.path / "joint-so-far.json"

    @property
    def store_so_far(self) -> Path:
        """Its coordinator's store."""
        return self.path / "store-so-far.sqlite"

    @property
    def logs(self) -> Path:
        """What each process wrote."""
        return self.path / "processes"

    @property
    def scans(self) -> Path:
        """Simulated scans and truth."""
        return self.path / "scans"

    @contextmanager
    def taken(self) -> Iterator[None]:
        """Have the folder for this process in the block; what an earlier team's wrote goes.

        The kernel gives it back however this process ends.

        Raises
        ------
        FileError
            If another team runs into it, which finds all as it was; or it cannot be made.
        """
        try:
            self.path.mkdir(parents=True, exist_ok=True)
            lock = os.open(self.path / ".lock", os.O_RDWR | os.O_CREAT, 0o666)
        except OSError as error:
            raise FileError(self.path, f"cannot be made a folder ({error.strerror})") from error
        try:
            self._lock(lock)
            self._clear_logs()
            yield
        finally:
            os.close(lock)

    def _lock(self, lock: int) -> None:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            problem = "in use by another mapweave team; expected another --output"
            raise FileError(self.path, problem) from error

    def _clear_logs(self) -> None:
        try:
            self.logs.mkdir(exist_ok=True)
            for log in self.logs.glob("*.log"):
                log.unlink()
        except OSError as error:
            raise FileError(self.logs, f"cannot be made a folder ({error.strerror})") from error
