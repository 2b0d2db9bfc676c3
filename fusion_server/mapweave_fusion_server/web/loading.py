"""The way in to what needs Starlette and uvicorn, the optional extra ``web``."""

from collections.abc import Callable
from contextlib import AbstractContextManager
from typing import TypeAlias

from mapweave.config import Config
from mapweave.errors import MissingExtraError
from mapweave_fusion_server.store import Store
from mapweave_fusion_server.web.address import HttpAddress
from mapweave_fusion_server.web.feed import Feed

OPTIONAL = {"starlette", "uvicorn", "prometheus_client", "anyio", "h11", "click"}
LivePage: TypeAlias = Callable[
    [HttpAddress, str, Store, Config, Feed, str], AbstractContextManager[HttpAddress]
]


def live_page() -> LivePage:
    """Return what serves the live page.

    Raises
    ------
    MissingExtraError
        If a package that it takes is not installed.
    """
    try:
        from mapweave_fusion_server.web import server
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] not in OPTIONAL:
            raise
        raise MissingExtraError("the live page", "web") from error

    return server.live_page
