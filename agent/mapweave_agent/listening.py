"""What a robot listens to."""

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager

import zenoh

from mapweave_protocol.link.assembler import MESSAGES_TO_COMPLETE
from mapweave_protocol.link.session import OnSample, declare_subscriber
from mapweave_protocol.wire.keys import (
    ALIGNMENT,
    COORDINATOR_LIVE,
    JOINT_STATUS,
    LIVE,
    MAP,
    ORDER,
    STATUS,
)


@contextmanager
def listening(session: zenoh.Session, team: str, robot: str, put: OnSample) -> Iterator[None]:
    """Subscribe to the peers' presence, then to what they, coordinators and operators say.

    Parameters
    ----------
    put
        Called with each sample, in a thread of Zenoh's.
    """
    maps = MAP.pattern(team=team)
    with ExitStack() as stack:
        for live in (LIVE, COORDINATOR_LIVE):
            tokens = live.pattern(team=team)
            stack.enter_context(session.liveliness().declare_subscriber(tokens, put, history=True))
        for pair in ({"reference": robot}, {"other": robot}):
            found = ALIGNMENT.pattern(team=team, **pair)
            stack.enter_context(declare_subscriber(session, found, put))
        stack.enter_context(declare_subscriber(session, maps, put, history=MESSAGES_TO_COMPLETE))
        for said in (STATUS, JOINT_STATUS, ORDER):
            stack.enter_context(session.declare_subscriber(said.pattern(team=team), put))
        yield
