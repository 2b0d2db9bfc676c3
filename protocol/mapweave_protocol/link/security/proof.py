"""How orders prove who gave them: by a signature where there are keys, and not at all without."""

from collections.abc import Callable
from types import ModuleType
from typing import TypeAlias

from mapweave.errors import MissingExtraError
from mapweave_protocol.link.security.settings import LinkSettings
from mapweave_protocol.wire.messages import OrderMessage

Sign: TypeAlias = Callable[[OrderMessage], OrderMessage]
Check: TypeAlias = Callable[[OrderMessage], None]


def signing(link: LinkSettings) -> Sign:
    """Return what makes an order one of the member whose keys they are.

    Raises
    ------
    FileError
        If the keys cannot be used.
    MissingExtraError
        If what signs is not installed.
    """
    if link.keys is None:
        return lambda order: order
    sign: Sign = _signatures().Signer(link.keys).signed
    return sign


def checking(link: LinkSettings) -> Check:
    """Return what raises `MessageError` for an order of which nothing proves who gave it.

    Raises
    ------
    FileError, MissingExtraError
        As of `signing`.
    """
    if link.keys is None:
        return unchecked
    check: Check = _signatures().Verifier(link.keys).check
    return check


def unchecked(order: OrderMessage) -> None:
    """Take any order: without keys anybody may say to be anyone."""


def _signatures() -> ModuleType:
    # Robots pass orders on and check none: they go without the package.
    try:
        from mapweave_protocol.link.security import signatures
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] != "cryptography":
            raise
        raise MissingExtraError("orders under keys", "tls") from error
    return signatures
