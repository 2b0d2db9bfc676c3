"""A link that was opened again but brings nothing: noticed, and cut, so that it is opened anew.

Who stood still for longer than the lease (a computer that slept, a process that was stopped) while
much was sent to it connects again within a millisecond of waking up. A router of Zenoh 1.10.2 that
is done with the old connection only a moment later may strike out the new one with it: it takes
what the client says and sends keep-alives, so that both ends believe in the link, but no message.
"""

import logging
import os
import socket
import stat
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import zenoh

LOOKED_AT_AFTER = (2.0, 8.0)  # [s] since it was opened, then since the look before
ANSWER_WITHIN = 3.0  # [s] a router says within milliseconds that there are no more answers
TRIES = 2  # without an answer: a router may be busy
NOWHERE = "mapweave/v2/nowhere"  # a token that nobody has

_log = logging.getLogger(__name__)


@contextmanager
def mending_deaf_links(
    session: zenoh.Session, *, looked_at_after: Sequence[float] = LOOKED_AT_AFTER
) -> Iterator[None]:
    """Cut each link of `session` that was opened again and is deaf, as long as the block runs.

    Zenoh then opens it anew, and declares again what the session has declared.

    Parameters
    ----------
    looked_at_after
        [s] since it was opened, then since the look before.
    """
    opened, ended = threading.Event(), threading.Event()

    def note(event: zenoh.TransportEvent) -> None:
        if event.kind == zenoh.SampleKind.PUT:
            opened.set()

    def mend() -> None:
        while opened.wait() and not ended.is_set():
            opened.clear()
            for pause in looked_at_after:
                if ended.wait(pause):
                    return
                # A session that is being closed is asked nothing more: it would raise.
                if not any(ended.is_set() or answers(session) for _ in range(TRIES)):
                    _log.warning("nothing comes on the link that was opened again: opened anew")
                    cut_links(session)
                    break

    thread = threading.Thread(target=mend, name="mending-links", daemon=True)
    listener = session.info.declare_transport_events_listener(note, history=False)
    thread.start()
    try:
        yield
    finally:
        listener.undeclare()  # type: ignore[no-untyped-call]
        ended.set()
        opened.set()
        thread.join(timeout=0.1)  # it may wait for an answer, which ends with the session


def answers(session: zenoh.Session) -> bool:
    """Tell whether a question comes back with its end rather than with the end of patience."""
    asked = time.monotonic()
    for _ in session.liveliness().get(NOWHERE, timeout=ANSWER_WITHIN):
        pass
    return time.monotonic() - asked < ANSWER_WITHIN


def cut_links(session: zenoh.Session) -> None:
    """Shut down the sockets of the session's links, which Zenoh offers no call for.

    Only what goes out, so that the router has closed the link before this end connects again.
    """
    ports = {(_port(link.src), _port(link.dst)) for link in session.info.links()}
    for opened in Path("/dev/fd").iterdir():
        descriptor = int(opened.name)
        try:
            if not stat.S_ISSOCK(os.fstat(descriptor).st_mode):
                continue
            with socket.socket(fileno=os.dup(descriptor)) as end:
                if (end.getsockname()[1], end.getpeername()[1]) in ports:
                    end.shutdown(socket.SHUT_WR)
        except (OSError, IndexError):  # closed meanwhile, or of another family
            continue


def _port(locator: str) -> int:
    return int(locator.partition("#")[0].rpartition(":")[2])
