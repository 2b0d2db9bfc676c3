"""Why a router cannot be reached, in words: Zenoh only says that time ran out."""

import socket
import ssl
from collections.abc import Sequence

from mapweave_protocol.link.security.folder import AUTHORITY, CERTIFICATE, KEY, KeyFolder

PATIENCE = 1.0  # [s] for one endpoint
HEARD_WITHIN = 0.3  # [s] in which a router says that it does not know a certificate


def reason_of(endpoints: Sequence[str], keys: KeyFolder | None) -> str:
    """Return why none of `endpoints` lets us in, each with its reason."""
    return "; ".join(f"{endpoint}: {_reason(endpoint, keys)}" for endpoint in endpoints)


def _reason(endpoint: str, keys: KeyFolder | None) -> str:
    protocol, _, address = endpoint.partition("/")
    host, _, port = address.partition("#")[0].partition("?")[0].rpartition(":")
    host = host.strip("[]")
    try:
        socket.getaddrinfo(host, int(port))
    except (socket.gaierror, UnicodeError):
        return "no such host"
    if protocol in ("udp", "quic"):
        return "no answer"
    try:
        with socket.create_connection((host, int(port)), PATIENCE) as connection:
            if protocol == "tls" and keys is not None:
                return _handshake(connection, host, keys)
    except TimeoutError:
        return "no answer"
    except ConnectionRefusedError:
        return "refused: nothing listens there"
    except OSError as error:
        return error.strerror or str(error)
    return f"something listens there, but not a router that lets us in{_hint(endpoint, keys)}"


def _hint(endpoint: str, keys: KeyFolder | None) -> str:
    """Return what is wanted by a router that lets in only members of its team."""
    if keys is not None:
        return ""
    encrypted = f"tls/{endpoint.partition('/')[2]}"
    where = "" if endpoint == encrypted else f"{encrypted} and "
    return f" (if it has keys, give {where}--tls DIR)"


def _handshake(connection: socket.socket, host: str, keys: KeyFolder) -> str:
    """Return what either side has against the other's certificate."""
    try:
        context = ssl.create_default_context(cafile=str(keys.path / AUTHORITY))
        context.load_cert_chain(keys.path / CERTIFICATE, keys.path / KEY)
        with context.wrap_socket(connection, server_hostname=host) as secure:
            secure.settimeout(HEARD_WITHIN)
            secure.recv(1)
    except TimeoutError:
        return "it takes our certificate, and does not let us in all the same"
    except ssl.SSLCertVerificationError as error:
        return f"its certificate is not to be trusted: {error.verify_message}"
    except ssl.SSLError as error:
        told = (error.reason or "").lower().replace("_", " ")
        return f"it does not take our certificate ({told})" if told else "no encrypted connection"
    return "it ended the connection: it does not take our certificate"
