"""A link to the team that comes when it comes: a robot that drives does not wait for it."""

import math
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from typing import TypeAlias

import zenoh

from mapweave_protocol.errors import UnreachableError
from mapweave_protocol.link.security.settings import LinkSettings
from mapweave_protocol.link.session import PAUSE, open_session

Connected: TypeAlias = Callable[[], zenoh.Session | None]
"""Returns the session, None until a router has answered."""


GRACE = 2.0  # [s] without a router, after which that is said
LOOK = 0.5  # [s] between two looks


class LinkNews:
    """Tells when a session's router is no longer reached, and when it is again.

    Parameters
    ----------
    warn, tell
        Told the one, and the other.
    """

    def __init__(self, warn: Callable[[str], None], tell: Callable[[str], None]) -> None:
        self._warn, self._tell = warn, tell
        self._looked = self._linked = -math.inf  # [s]
        self._is_away = False

    def look(self, session: zenoh.Session | None, now: float) -> None:
        """Look whether the router is there; `now` [s] by any clock."""
        if session is None or now - self._looked < LOOK:
            return
        self._linked = now if self._looked == -math.inf else self._linked
        self._looked = now
        if session.info.routers_zid():
            if self._is_away:
                self._tell("the router is reached again")
            self._linked, self._is_away = now, False
        elif not self._is_away and now - self._linked >= GRACE:
            self._is_away = True
            self._warn("no router is reached any more: maps by itself until one is")


@contextmanager
def connecting(
    endpoints: Sequence[str], on_wait: Callable[[str], None], link: LinkSettings
) -> Iterator[Connected]:
    """Give a block the session when a router has answered, which is tried as long as it runs.

    Parameters
    ----------
    endpoints, link
        As of `open_session`.
    on_wait
        The same, told each reason once; called in whatever thread.

    Raises
    ------
    EndpointError
        If an endpoint is not one, or there is none.
    """
    opened: list[zenoh.Session] = []
    told: list[str] = []
    over = threading.Event()

    def answered() -> bool:
        try:
            opened.append(stack.enter_context(open_session(endpoints, patience=0.0, link=link)))
        except UnreachableError as error:
            if told[-1:] != [error.reason]:
                told.append(error.reason)
                on_wait(error.reason)
        return bool(opened)

    def connect() -> None:
        while not over.wait(PAUSE) and not answered():
            pass

    with ExitStack() as stack:
        # Where a router is there, or the endpoint is none, that is known before the block begins.
        connector = None if answered() else threading.Thread(target=connect, name="connecting")
        if connector is not None:
            connector.start()
        try:
            yield lambda: opened[0] if opened else None
        finally:
            over.set()
            if connector is not None:
                connector.join()
