"""The way in: of those who have not shown yet who they are, few wait, and the oldest goes first.

Whoever reaches the port can open connections and say nothing. Each takes a file descriptor, and
the coordinator needs some for its store and its router.
"""

import asyncio
import os
import socket
import ssl
from collections.abc import Mapping
from typing import Any

from uvicorn.protocols.http.h11_impl import H11Protocol

from mapweave.errors import ArgumentError
from mapweave_fusion_server.web.access.member import note_certificate
from mapweave_fusion_server.web.address import HttpAddress
from mapweave_protocol.link.guard.refusals import Refusals

MAX_WAITING = 128  # connections of whom nobody knows yet whose they are
MAX_CONNECTIONS = 256


class Door(socket.socket):
    """A listening socket that asyncio serves.

    Parameters
    ----------
    address
        Where.
    refusals
        Counts who was not let in.

    Raises
    ------
    ArgumentError
        If nothing can be served there.
    """

    def __init__(self, address: HttpAddress, refusals: Refusals) -> None:
        family = socket.AF_INET6 if ":" in address.host else socket.AF_INET
        try:
            made = socket.create_server(
                (address.host, address.port), family=family, backlog=MAX_WAITING
            )
        except OSError as error:
            why = os.strerror(error.errno) if error.errno else str(error)
            raise ArgumentError("--http", f"{address.authority}: {why}") from error
        super().__init__(fileno=made.detach())
        self._refusals = refusals
        self._waiting: dict[object, socket.socket] = {}

    def accept(self) -> tuple[socket.socket, Any]:
        """Return the next connection and whose it is; of too many that wait, end the oldest."""
        connection, peer = super().accept()
        for known, waiting in list(self._waiting.items()):
            if waiting.fileno() < 0:
                del self._waiting[known]
        while len(self._waiting) >= MAX_WAITING:
            oldest = next(iter(self._waiting))
            _end(self._waiting.pop(oldest))
            self._refuse("too many wait who have not shown who they are")
        self._waiting[peer] = connection
        return connection, peer

    def told(self, context: ssl.SSLContext) -> None:
        """Have `context` tell why somebody is not let in: uvicorn and asyncio say nothing of it."""
        refuse = self._refuse

        class Told(ssl.SSLObject):
            def do_handshake(self) -> None:
                try:
                    super().do_handshake()
                except (ssl.SSLWantReadError, ssl.SSLWantWriteError):
                    raise
                except ssl.SSLError as error:
                    refuse(_reason(error))
                    raise

        context.sslobject_class = Told

    def protocol(self) -> type[asyncio.Protocol]:
        """Return what speaks with those who are let in."""
        door = self

        class Admitted(H11Protocol):
            """HTTP/1.1 that knows to whom the other side's certificate is made out."""

            def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
                super().connection_made(transport)
                certificate: Mapping[str, Any] | None = transport.get_extra_info("peercert")
                self.app_state = note_certificate(self.app_state, certificate)
                door._waiting.pop(transport.get_extra_info("peername"), None)
                if len(self.connections) > MAX_CONNECTIONS:
                    door._refuse("too many connections")
                    transport.abort()

        return Admitted

    def _refuse(self, why: str) -> None:
        self._refusals.add("page", "connection", "page", why)


def _reason(error: ssl.SSLError) -> str:
    verified = getattr(error, "verify_message", None)
    return verified or (error.reason or str(error)).replace("_", " ").lower()


def _end(connection: socket.socket) -> None:
    """Have whoever serves it see its end, and close it."""
    try:
        connection.shutdown(socket.SHUT_RDWR)
    except OSError:
        return  # it has ended already
