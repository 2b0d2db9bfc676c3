"""Where the page is served: on this machine, or with keys to a team's members on others."""

import ipaddress
import re
import secrets
from dataclasses import dataclass, replace

from mapweave.errors import ArgumentError, FileError
from mapweave_protocol.link.security.folder import IDENTITY, KeyFolder

MAX_PORT = 65535
EXPECTED = f"expected HOST:PORT, the port from 0 (any that is free) to {MAX_PORT}"
TOKEN_VARIABLE = "MAPWEAVE_HTTP_TOKEN"  # who starts a coordinator may choose it
HTTPS_PORT = 443  # which browsers leave out


@dataclass(frozen=True, slots=True)
class HttpAddress:
    """An address of this machine, and a port.

    Attributes
    ----------
    host
        Such as ``127.0.0.1``; ``0.0.0.0`` is all of them.
    port
        0 asks for any that is free.
    keys
        By which the page is encrypted and those who look prove who they are; None for a page that
        only this machine reaches.
    """

    host: str
    port: int
    keys: KeyFolder | None = None

    @property
    def is_here(self) -> bool:
        """Whether this machine alone reaches it."""
        return ipaddress.ip_address(self.host).is_loopback

    @property
    def authority(self) -> str:
        """Both, as they stand in an address."""
        return _authority(self.host, self.port)

    @property
    def names(self) -> tuple[str, ...]:
        """What stands in the addresses by which it is reached."""
        if self.keys is None:
            return self.authority, f"localhost:{self.port}"
        named = tuple(_authority(name, self.port) for name in self.keys.page)
        bare = tuple(name.removesuffix(f":{HTTPS_PORT}") for name in named)
        return (*named, *bare) if self.port == HTTPS_PORT else named

    @property
    def origins(self) -> tuple[str, ...]:
        """What a browser calls a page of it."""
        scheme = "http" if self.keys is None else "https"
        return tuple(f"{scheme}://{name}" for name in self.names)

    def url(self, token: str = "") -> str:
        """Return the page's address; `token`, behind ``#``, is never sent to a server by itself.

        With keys it is the certificate that says who may give orders, and no token.
        """
        first = self.origins[0]
        return f"{first}/#token={token}" if token and self.keys is None else f"{first}/"


def http_address(text: str) -> HttpAddress:
    """Return the address that `text` says.

    Raises
    ------
    ValueError
        If it is none of this machine's.
    """
    match = re.fullmatch(r"(\[[0-9a-fA-F:]+\]|[^\s/#?@:\[\]]+):([0-9]{1,5})", text)
    if match is None or int(match[2]) > MAX_PORT:
        raise ValueError(f"{text}: {EXPECTED}")
    host = match[1].strip("[]").lower()
    try:
        ip = ipaddress.ip_address("127.0.0.1" if host == "localhost" else host)
    except ValueError as error:
        raise ValueError(
            f"{text}: expected an IP address of this machine, such as 127.0.0.1, or 0.0.0.0 for all"
        ) from error
    return HttpAddress(str(ip), int(match[2]))


def loopback_address(text: str) -> HttpAddress:
    """Return the address that `text` says.

    Raises
    ------
    ValueError
        If it is none, or another machine could reach it.
    """
    address = http_address(text)
    if not address.is_here:
        raise ValueError(
            f"{text}: without encryption the page is served on this machine only; expected a host"
            " such as 127.0.0.1 (from elsewhere: ssh -L)"
        )
    return address


def with_keys(address: HttpAddress, keys: KeyFolder | None) -> HttpAddress:
    """Return `address` with the keys that it needs: none where this machine alone reaches it.

    Raises
    ------
    ArgumentError
        If others reach it, and there are no keys.
    FileError
        If the keys are not made for a page that others reach.
    """
    if address.is_here:
        return address
    if keys is None:
        raise ArgumentError(
            "--http",
            f"{address.authority}: others reach it, and whoever does would read all; expected"
            " --tls DIR (mapweave keys TEAM --page HOST), or 127.0.0.1 (from elsewhere: ssh -L)",
        )
    if not keys.page:
        raise FileError(
            keys.path / IDENTITY,
            "not for a page that others reach; expected the coordinator's keys, as made by"
            " mapweave keys TEAM --page HOST",
        )
    return replace(address, keys=keys)


def new_token() -> str:
    """Return a secret that whoever gives orders by the page must know."""
    return secrets.token_hex(16)


def _authority(host: str, port: int) -> str:
    return f"[{host}]:{port}" if ":" in host else f"{host}:{port}"
