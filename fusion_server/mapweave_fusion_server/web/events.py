"""Server-sent events: what changed, as it changes.

An event ``version`` for each version, its number as the event's id: who comes again with the last
id it had (as browsers do by themselves) gets all that it missed, in order. Who had the version
before is told in it what changed, if that version has just been made. Beside these, without an id:
``searched`` with the coverage of the latest version, which takes longer to work out, ``team`` when
robots or coordinator were reported, ``story`` with lines of the journal, ``poses`` where the robots
are, ten times a second at the most.

Each client is served at its own pace from the store; nothing is queued for a slow one.
"""

import asyncio
from collections.abc import AsyncIterator
from contextlib import suppress

from starlette.concurrency import run_in_threadpool

from mapweave_fusion_server.web.knowledge import Knowledge
from mapweave_fusion_server.web.versions.history import History
from mapweave_fusion_server.web.versions.json_text import to_json

AT_ONCE = 256  # versions read from the store
PING = 15.0  # [s] after which a client that is gone is noticed
PACE = 0.1  # [s] between two looks at where the robots are
RETRY = "retry: 1000\n\n"  # [ms] after which a browser comes again


class Bell:
    """Wakes all who wait, from any thread."""

    def __init__(self) -> None:
        self._loop: asyncio.AbstractEventLoop | None = None
        self._event = asyncio.Event()
        self.closing = False

    def begin(self) -> None:
        """Take the running loop for the one in which is waited."""
        self._loop = asyncio.get_running_loop()

    def ring(self) -> None:
        """Wake all who wait."""
        loop = self._loop
        if loop is not None and not loop.is_closed():
            loop.call_soon_threadsafe(self._wake)

    def close(self) -> None:
        """Wake all who wait, for the last time."""
        self.closing = True
        self.ring()

    @property
    def next(self) -> asyncio.Event:
        """What the next ring sets."""
        return self._event

    def _wake(self) -> None:
        self._event.set()
        self._event = asyncio.Event()


class Stream:
    """The events of one client.

    Parameters
    ----------
    after
        The version that the client has; None if it has none: then it gets the latest first.
    """

    def __init__(self, knowledge: Knowledge, bell: Bell, after: int | None) -> None:
        self._knowledge = knowledge
        self._bell = bell
        latest = knowledge.history.latest
        # Of another store it may have a version that is still to come here.
        self._version = max(0, latest - 1) if after is None or after > latest else after
        self._line = knowledge.story.count
        self._has_one = after is not None
        self._searched = 0
        self._team = b""
        self._poses = 0

    async def __aiter__(self) -> AsyncIterator[bytes]:
        """Yield events until the server closes."""
        self._bell.begin()
        yield RETRY.encode()
        while not self._bell.closing:
            # Who is rung for while it writes finds it next time round: nothing is missed.
            bell = self._bell.next
            async for event in self._news():
                yield event
            async for event in self._moves(bell):
                yield event

    async def _news(self) -> AsyncIterator[bytes]:
        while created := await run_in_threadpool(self._versions):
            for number, time in created:
                yield _event("version", await run_in_threadpool(self._told, number, time), number)
                self._version, self._has_one = number, True
        searched = self._knowledge.searching.found
        if searched is not None and self._searched < searched.version <= self._version:
            self._searched = searched.version
            yield _event("searched", searched.text)
        team = self._knowledge.team_json()
        if team != self._team:
            self._team = team
            yield _event("team", team)
        lines = self._knowledge.story.since(self._line)
        if lines:
            self._line = lines[-1]["number"]
            yield _event("story", to_json({"lines": lines}))

    async def _moves(self, bell: asyncio.Event) -> AsyncIterator[bytes]:
        """Yield where the robots are, as long as there is no other news; then return."""
        silent = 0.0
        while not bell.is_set():
            positions = self._knowledge.feed.positions
            if positions.count != self._poses:
                self._poses, silent = positions.count, 0.0
                yield _event("poses", to_json(positions.content()))
            elif silent > PING:
                silent = 0.0
                yield b": still here\n\n"
            with suppress(TimeoutError):  # no news but of where they are
                await asyncio.wait_for(bell.wait(), PACE)
            silent += PACE

    @property
    def _history(self) -> History:
        return self._knowledge.history

    def _told(self, number: int, time: float) -> bytes:
        """Return what is told of a version, with what changed to who had the one before it."""
        content = to_json({"version": number, "created": time, "series": self._history.series})
        changes = self._knowledge.changes_json(number) if self._has_one else None
        if changes is None:
            return content
        self._knowledge.searching.ask(number)
        return b'%s,"changes":%s}' % (content[:-1], changes)

    def _versions(self) -> list[tuple[int, float]]:
        # Paths are kept a moment after the version is stored: who is told finds both.
        there = self._knowledge.paths.latest
        created = self._history.created(self._version, AT_ONCE)
        return [(number, time) for number, time in created if number <= there]


def _event(kind: str, data: bytes, number: int | None = None) -> bytes:
    identity = b"" if number is None else b"id: %d\n" % number
    return b"event: %s\n%sdata: %s\n\n" % (kind.encode(), identity, data)


def after_of(last_event_id: str | None) -> int | None:
    """Return the version that a client says it has, None if it says none."""
    text = last_event_id or ""
    return int(text) if text.isascii() and text.isdigit() and len(text) < 16 else None
