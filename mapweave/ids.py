"""Names of robots and teams: one rule, because they become parts of keys and files."""

import re

from mapweave.errors import InvalidIdError

ID_PATTERN = r"^[a-z0-9][a-z0-9_-]{0,31}$"
# Of a component without its number: its robot, and its run where the robot does not tell.
RUN_PATTERN = r"^[a-z0-9][a-z0-9_-]{0,31}(@[a-z0-9][a-z0-9_-]{0,31})?$"
_ID = re.compile(ID_PATTERN + r"(?!\n)")


def is_id(name: str) -> bool:
    """Tell whether `name` is a valid id."""
    return _ID.fullmatch(name) is not None


def check_id(kind: str, name: str) -> str:
    """Return `name` if it is a valid id, such as a robot's.

    Parameters
    ----------
    kind
        What it names, for the message: ``robot`` or ``team``.

    Raises
    ------
    InvalidIdError
        If it is not ``[a-z0-9][a-z0-9_-]{0,31}``.
    """
    if not (isinstance(name, str) and _ID.fullmatch(name)):
        raise InvalidIdError(kind, name)
    return name
