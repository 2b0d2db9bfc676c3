"""A TCP relay between a client and its router: a link that can be cut, slowed, and counted."""

import asyncio
import random
import threading
from collections.abc import Coroutine
from concurrent.futures import Future
from types import TracebackType
from typing import Any, Self

CHUNK = 1400  # [bytes]: about what a packet carries
RESENT_AFTER = 0.2  # [s] after which TCP sends a lost packet again, at the least


class Relay:
    """A relay on this machine, in a thread of its own; a context manager.

    A packet that is lost holds up all behind it until TCP has sent it again: that is what loss
    comes to for whoever uses TCP, so it is what is played here.

    Parameters
    ----------
    target
        The router's endpoint, such as ``tcp/127.0.0.1:7447``.
    delay
        How long a packet takes, each way [s].
    loss
        Which share of packets is lost.
    seed
        Of which ones are.

    Attributes
    ----------
    endpoint
        Where clients connect.
    sent, received
        Bytes from the clients to the router, and back.
    """

    def __init__(
        self, target: str, *, delay: float = 0.0, loss: float = 0.0, seed: int = 0
    ) -> None:
        self._kind, _, address = target.partition("/")
        host, _, port = address.rpartition(":")
        self._target = host, int(port)
        self._delay = delay
        self._loss = loss
        self._random = random.Random(seed)
        self._writers: set[asyncio.StreamWriter] = set()
        self._passing = asyncio.Event()
        self._passing.set()
        self._server: asyncio.Server | None = None
        self._port = 0
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever, name="relay")
        self.sent = 0
        self.received = 0

    @property
    def endpoint(self) -> str:
        """Where clients connect."""
        return f"{self._kind}/127.0.0.1:{self._port}"

    def __enter__(self) -> Self:
        self._thread.start()
        self.restore()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.sever()
        self._run(self._end()).result()
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.close()

    def sever(self) -> None:
        """Cut all connections; new ones are refused until `restore`."""
        self._run(self._sever()).result()

    def silence(self) -> None:
        """Pass on nothing until `restore`, but cut no connection: their ends find out."""
        self._run(self._silence()).result()

    def restore(self) -> None:
        """Let clients connect, at the same endpoint as before, and pass on what was held back."""
        self._run(self._restore()).result()

    def _run(self, coroutine: Coroutine[Any, Any, None]) -> Future[None]:
        return asyncio.run_coroutine_threadsafe(coroutine, self._loop)

    async def _silence(self) -> None:
        self._passing.clear()
        if self._server is not None:
            self._server.close()
            self._server = None

    async def _restore(self) -> None:
        self._passing.set()
        if self._server is None:
            self._server = await asyncio.start_server(self._serve, "127.0.0.1", self._port)
            self._port = self._server.sockets[0].getsockname()[1]

    async def _sever(self) -> None:
        if self._server is not None:
            self._server.close()
            self._server = None
        for writer in list(self._writers):
            writer.transport.abort()
        # Who serves them sees that they are gone.
        await asyncio.sleep(0)

    async def _end(self) -> None:
        serving = asyncio.all_tasks() - {asyncio.current_task()}
        for task in serving:
            task.cancel()
        await asyncio.gather(*serving, return_exceptions=True)

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        try:
            from_router, to_router = await asyncio.open_connection(*self._target)
        except OSError:
            writer.transport.abort()
            return
        both = {writer, to_router}
        self._writers |= both
        try:
            async with asyncio.TaskGroup() as tasks:
                tasks.create_task(self._pass_on(reader, to_router, outwards=True))
                tasks.create_task(self._pass_on(from_router, writer, outwards=False))
        except* OSError:
            pass  # one end is gone, and so is the other
        finally:
            self._writers -= both
            for each in both:
                each.transport.abort()

    async def _pass_on(
        self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter, *, outwards: bool
    ) -> None:
        """Pass on what comes, each packet after its time, all in order."""
        waiting: asyncio.Queue[tuple[float, bytes]] = asyncio.Queue()
        async with asyncio.TaskGroup() as tasks:
            tasks.create_task(self._deliver(waiting, writer))
            free = 0.0
            while data := await reader.read(CHUNK):
                if outwards:
                    self.sent += len(data)
                else:
                    self.received += len(data)
                free = max(free, self._loop.time() + self._delay + self._held_up())
                waiting.put_nowait((free, data))
            raise ConnectionResetError

    def _held_up(self) -> float:
        """Return how long TCP takes to bring a packet through [s]: each loss doubles its wait."""
        pause, again = 0.0, RESENT_AFTER + 2 * self._delay
        while self._random.random() < self._loss:
            pause, again = pause + again, 2 * again
        return pause

    async def _deliver(
        self, waiting: "asyncio.Queue[tuple[float, bytes]]", writer: asyncio.StreamWriter
    ) -> None:
        while True:
            due, data = await waiting.get()
            await asyncio.sleep(max(0.0, due - self._loop.time()))
            await self._passing.wait()
            writer.write(data)
            await writer.drain()
