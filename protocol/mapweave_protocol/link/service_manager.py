"""What a service manager is told (sd_notify(3)): ready, alive, stopping. Nothing where none is."""

import contextlib
import os
import socket
import time
from collections.abc import Mapping

ADDRESS, INTERVAL = "NOTIFY_SOCKET", "WATCHDOG_USEC"
PATIENCE = (
    1.0  # [s] with a manager that has not read ten messages: what is said once must not be lost
)


class ServiceManager:
    """Tells systemd, or whoever stands in for it, how this process is.

    Parameters
    ----------
    environment
        Names the socket, and how often a sign of life is expected.
    """

    def __init__(self, environment: Mapping[str, str] = os.environ) -> None:
        address = environment.get(ADDRESS, "")
        # A name that begins with @ is one of Linux's abstract namespace.
        self._address = "\0" + address[1:] if address.startswith("@") else address
        expected = environment.get(INTERVAL, "")
        self._pause = int(expected) / 2e6 if expected.isdigit() else None
        self._next = -1.0
        self._ready = False

    def alive(self) -> None:
        """Say that the main loop turns; the first time, that the service is ready."""
        if not self._ready:
            self._ready = True
            self._say("READY=1", PATIENCE)
        now = time.monotonic()
        if self._pause is not None and now >= self._next:
            self._next = now + self._pause
            self._say("WATCHDOG=1", 0.0)  # the next one says the same

    def stopping(self) -> None:
        """Say that the service ends."""
        self._say("STOPPING=1", PATIENCE)

    def _say(self, state: str, patience: float) -> None:
        if not self._address:
            return
        # A manager that is gone, or slow, must not stop the service.
        with (
            contextlib.suppress(OSError),
            socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC) as manager,
        ):
            manager.settimeout(patience)
            manager.sendto(state.encode(), self._address)
