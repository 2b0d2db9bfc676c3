"""Between a robot and its router: passes bytes on, and counts them."""

import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress

BLOCK = 65536  # [bytes] passed on at once


class Relay:
    """What a relay has passed on.

    Attributes
    ----------
    endpoint
        Where it listens, as Zenoh writes it.
    up, down
        Bytes from who connected, and to it, all that TCP carries.
    connections
        How many there were; on a machine with too much to do one may be given up.
    """

    def __init__(self, listener: socket.socket, target: tuple[str, int]) -> None:
        self.endpoint = f"tcp/127.0.0.1:{listener.getsockname()[1]}"
        self.up = 0
        self.down = 0
        self.connections = 0
        self._listener = listener
        self._target = target
        self._open: list[socket.socket] = []

    def serve(self) -> None:
        """Accept connections until the listener is closed."""
        with suppress(OSError):
            while True:
                near, _ = self._listener.accept()
                self.connections += 1
                far = socket.create_connection(self._target)
                self._open += [near, far]
                threading.Thread(target=self._pass_up, args=(near, far), daemon=True).start()
                threading.Thread(target=self._pass_down, args=(far, near), daemon=True).start()

    def close(self) -> None:
        """End all connections."""
        self._listener.close()
        for end in self._open:
            _shut(end)

    def _pass_up(self, near: socket.socket, far: socket.socket) -> None:
        with suppress(OSError):  # the other end has gone meanwhile
            for block in _blocks(near):
                self.up += len(block)
                far.sendall(block)
        _shut(far)

    def _pass_down(self, far: socket.socket, near: socket.socket) -> None:
        with suppress(OSError):
            for block in _blocks(far):
                self.down += len(block)
                near.sendall(block)
        _shut(near)


@contextmanager
def relay_to(endpoint: str) -> Iterator[Relay]:
    """Give a relay to an endpoint such as ``tcp/127.0.0.1:7447``."""
    host, _, port = endpoint.removeprefix("tcp/").rpartition(":")
    listener = socket.create_server(("127.0.0.1", 0))
    relay = Relay(listener, (host, int(port)))
    threading.Thread(target=relay.serve, daemon=True).start()
    try:
        yield relay
    finally:
        relay.close()


def _blocks(source: socket.socket) -> Iterator[bytes]:
    with suppress(OSError):
        while block := source.recv(BLOCK):
            yield block


def _shut(end: socket.socket) -> None:
    with suppress(OSError):  # it is closed already
        end.shutdown(socket.SHUT_RDWR)
