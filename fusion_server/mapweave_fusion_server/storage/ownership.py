"""One process owns a store."""

import fcntl
import os
from pathlib import Path

from mapweave.errors import FileError


def own(path: Path) -> int:
    """Take the file for this process: two coordinators would both number the next version.

    Whoever only reads it is not kept out. To be closed after SQLite's own use of the file.

    Raises
    ------
    FileError
        If another process has it, or it may not be written: told now, and not by the first version.
    """
    try:
        file = os.open(path, os.O_RDWR)
    except OSError as error:
        raise FileError(path, f"the store cannot be written: {error.strerror}") from error
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        os.close(file)
        raise FileError(path, "in use by another mapweave server") from error
    return file
