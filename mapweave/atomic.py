"""Files that are written whole or not at all."""

import os
import secrets
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from mapweave.errors import FileError


@contextmanager
def replace_file(path: str | Path) -> Iterator[Path]:
    """Give a temporary file to write, which becomes `path` if the block ends well.

    It is in the same folder and has the same suffix. If the block fails it is removed, and a file
    that was at `path` before is untouched.

    Raises
    ------
    FileError
        If a file cannot be written there.
    """
    given = Path(path)
    target = Path(os.path.realpath(given))  # Through a symbolic link, not in its place.
    temporary = target.with_name(f".{secrets.token_hex(8)}{target.suffix}")
    try:
        _check_replaceable(given)
        temporary.open("xb").close()
        try:
            yield temporary
            temporary.replace(target)
        finally:
            temporary.unlink(missing_ok=True)
    except OSError as error:
        raise FileError(given, f"cannot be written ({error.strerror or error})") from error


def check_outputs(outputs: Sequence[Path | None], inputs: Sequence[Path]) -> None:
    """Find out before the work whether its results can be written.

    Parameters
    ----------
    outputs
        Files that will be written; None is passed over.
    inputs
        Files that were read, which must not be written over.

    Raises
    ------
    FileError
        If one cannot be written, or is another one's name as well.
    """
    taken = {path.resolve(): "is read, and would be overwritten" for path in inputs}
    for path in outputs:
        if path is None:
            continue
        _check_replaceable(path)
        _check_folder(path)
        if path.resolve() in taken:
            raise FileError(path, f"{taken[path.resolve()]}; expected another name")
        taken[path.resolve()] = "is named for two results"


def _check_folder(path: Path) -> None:
    """Check that a file can be made where `path` says."""
    folder = path.parent.resolve()
    if not folder.exists():
        raise FileError(path, f"cannot be written: there is no folder {folder}")
    if not folder.is_dir():
        raise FileError(path, f"cannot be written: {folder} is no folder")
    if not os.access(folder, os.W_OK):
        problem = f"cannot be written: the folder {folder} may not be written by this user"
        raise FileError(path, problem)


def _check_replaceable(path: Path) -> None:
    if path.exists() and not path.is_file():
        raise FileError(path, "is not a regular file; expected the name of a file to write")
