"""Serves the page from a thread of its own, so that the coordinator's work goes on."""

import ssl
import threading
from collections.abc import Awaitable, Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import uvicorn
from starlette.applications import Starlette
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import FileResponse, PlainTextResponse, Response
from starlette.routing import Mount, Route
from starlette.staticfiles import StaticFiles
from starlette.types import ASGIApp

from mapweave.config import Config
from mapweave.errors import FileError
from mapweave_fusion_server.monitoring import monitoring_routes
from mapweave_fusion_server.store import Store
from mapweave_fusion_server.web.access.door import MAX_CONNECTIONS, MAX_WAITING, Door
from mapweave_fusion_server.web.access.guard import Guard
from mapweave_fusion_server.web.address import HttpAddress
from mapweave_fusion_server.web.api import Api
from mapweave_fusion_server.web.events import Bell
from mapweave_fusion_server.web.feed import Feed, Seen
from mapweave_fusion_server.web.knowledge import Knowledge
from mapweave_fusion_server.web.orders import PageOrders
from mapweave_fusion_server.web.story import StoryTail
from mapweave_fusion_server.web.versions.history import History
from mapweave_fusion_server.web.versions.searching import Searching
from mapweave_protocol.link.guard.refusals import Refusals
from mapweave_protocol.link.security.folder import AUTHORITY, CERTIFICATE, KEY, KeyFolder

STATIC = Path(__file__).with_name("static")
GRACE = 2  # [s] for answers that are under way when the server stops


@contextmanager
def live_page(
    address: HttpAddress, team: str, store: Store, config: Config, feed: Feed, token: str
) -> Iterator[HttpAddress]:
    """Serve what `store` remembers and `feed` is handed while the block lasts.

    Parameters
    ----------
    address
        Where; port 0 takes any.
    team
        The team's name.
    config
        The coordinator's.
    token
        What requests that change something must bring in a header, where there are no keys.

    Yields
    ------
    HttpAddress
        The address with its port.

    Raises
    ------
    ArgumentError
        If nothing can be served there.
    """
    bell, history = Bell(), History(store)
    with StoryTail(bell.ring) as story, Searching(history, bell.ring) as searching:
        knowledge = Knowledge(team, config, feed, history, story, searching)
        with serving(address, knowledge, bell, token) as bound:
            yield bound


@contextmanager
def serving(
    address: HttpAddress, knowledge: Knowledge, bell: Bell, token: str
) -> Iterator[HttpAddress]:
    """Serve the page at `address` while the block lasts; give the address with its port.

    Raises
    ------
    ArgumentError
        If nothing can be served there.
    FileError
        If its keys cannot be used.
    """
    refusals = Refusals()
    with Door(address, refusals) as door, _keeping_up(knowledge, bell):
        bound = replace(address, port=door.getsockname()[1])
        app = Guard(application(knowledge, bell, refusals), bound, token, refusals)
        server = uvicorn.Server(_configuration(app, door, bound.keys))
        thread = threading.Thread(target=server.run, args=([door],), name="page", daemon=True)
        thread.start()
        try:
            yield bound
        finally:
            bell.close()
            server.should_exit = True
            thread.join()


def application(knowledge: Knowledge, bell: Bell, refusals: Refusals) -> ASGIApp:
    """Return the page and the JSON interface, for who is let in."""
    routes = [
        Route("/", _page("index.html")),
        Route("/api", _page("api.html")),
        Route("/api/openapi.json", _page("openapi.json")),
        *Api(knowledge, bell).routes,
        *monitoring_routes(knowledge.feed, refusals),
        *PageOrders(knowledge).routes,
        Mount("/static", StaticFiles(directory=STATIC)),
    ]
    return Starlette(routes=routes, exception_handlers={HTTPException: _tell})


@contextmanager
def _keeping_up(knowledge: Knowledge, bell: Bell) -> Iterator[None]:
    """Take each version that is handed over, beside the coordinator, and ring."""

    def take(seen: Seen) -> None:
        knowledge.take(seen)
        bell.ring()

    with (
        ThreadPoolExecutor(1, thread_name_prefix="versions") as worker,
        knowledge.feed.heard_by(lambda seen: worker.submit(take, seen)),
    ):
        worker.submit(take, knowledge.feed.seen)
        yield


def _page(name: str) -> Callable[[Request], Awaitable[Response]]:
    async def answer(_request: Request) -> Response:
        return FileResponse(STATIC / name, headers={"Cache-Control": "no-cache"})

    return answer


async def _tell(_request: Request, error: Exception) -> Response:
    """Answer with one line that says what is wrong."""
    status = error.status_code if isinstance(error, HTTPException) else 500
    detail = error.detail if isinstance(error, HTTPException) else "failed"
    return PlainTextResponse(f"{detail}\n", status)


def _configuration(app: ASGIApp, door: Door, keys: KeyFolder | None) -> uvicorn.Config:
    config = uvicorn.Config(
        app,
        http=door.protocol(),
        ws="none",
        loop="asyncio",
        lifespan="off",
        log_config=None,
        log_level="warning",
        access_log=False,
        server_header=False,
        limit_concurrency=MAX_CONNECTIONS,
        backlog=MAX_WAITING,
        timeout_graceful_shutdown=GRACE,
    )
    if keys is not None:
        config.ssl_certfile = keys.path / CERTIFICATE
        config.ssl_keyfile = keys.path / KEY
        config.ssl_ca_certs = str(keys.path / AUTHORITY)
        config.ssl_cert_reqs = ssl.CERT_REQUIRED  # nobody speaks before he has shown who he is
        try:
            config.load()
        except (OSError, ValueError) as error:
            raise FileError(keys.path, f"no keys that can be used: {error}") from error
        if config.ssl is not None:
            door.told(config.ssl)
    return config
