"""Where the page is served: on this machine only, as there is no encryption yet."""

import ipaddress
import re
import secrets
from dataclasses import dataclass

MAX_PORT = 65535
EXPECTED = f"expected HOST:PORT, the port from 0 (any that is free) to {MAX_PORT}"
TOKEN_VARIABLE = "MAPWEAVE_HTTP_TOKEN"  # who starts a coordinator may choose it


@dataclass(frozen=True, slots=True)
class HttpAddress:
    """A host of this machine, and a port.

    Attributes
    ----------
    host
        An address of the loopback network, such as ``127.0.0.1``.
    port
        0 asks for any that is free.
    """

    host: str
    port: int

    @property
    def authority(self) -> str:
        """Both, as they stand in an address."""
        return f"[{self.host}]:{self.port}" if ":" in self.host else f"{self.host}:{self.port}"

    def url(self, token: str = "") -> str:
        """Return the page's address; `token`, behind ``#``, is never sent to a server by itself."""
        return f"http://{self.authority}/" + (f"#token={token}" if token else "")


def loopback_address(text: str) -> HttpAddress:
    """Return the address that `text` says.

    Raises
    ------
    ValueError
        If it is none, or another machine could reach it.
    """
    match = re.fullmatch(r"(\[[0-9a-fA-F:]+\]|[^\s/#?@:\[\]]+):([0-9]{1,5})", text)
    if match is None or int(match[2]) > MAX_PORT:
        raise ValueError(f"{text}: {EXPECTED}")
    host = match[1].strip("[]").lower()
    if host == "localhost":
        host = "127.0.0.1"
    try:
        loopback = ipaddress.ip_address(host).is_loopback
    except ValueError:
        loopback = False
    if not loopback:
        raise ValueError(
            f"{text}: without encryption the page is served on this machine only; expected a host"
            " such as 127.0.0.1 (from elsewhere: ssh -L)"
        )
    return HttpAddress(host, int(match[2]))


def new_token() -> str:
    """Return a secret that whoever gives orders by the page must know."""
    return secrets.token_hex(16)
