"""A page that is served, of a store with versions made by hand; and what asks it as browsers do."""

import http.client
import json
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import pytest

from mapweave.config import Config
from mapweave.geometry import se2
from mapweave.maps import Alignment, JointComponent, JointMap, LineMap, RobotMap
from mapweave.reasons import Reason
from mapweave_fusion_server.store import Store
from mapweave_fusion_server.web.address import HttpAddress
from mapweave_fusion_server.web.feed import Feed
from mapweave_fusion_server.web.server import live_page
from mapweave_protocol.wire.codec import encode
from mapweave_protocol.wire.messages import JointMapMessage, PoseMessage

TOKEN = "only-who-reads-the-terminal-knows"
PATIENCE = 30.0  # [s]
MakeMap: TypeAlias = Callable[..., RobotMap]
Headers: TypeAlias = Mapping[str, str]


@dataclass(frozen=True)
class Answer:
    """What a server answered."""

    status: int
    headers: http.client.HTTPMessage
    body: bytes

    @property
    def json(self) -> Any:  # noqa: ANN401  # whatever it is
        """The body as JSON."""
        return json.loads(self.body)


@dataclass(frozen=True)
class Page:
    """A page that is served.

    Attributes
    ----------
    address
        Where.
    store, feed
        What it is of.
    """

    address: HttpAddress
    store: Store
    feed: Feed

    def ask(
        self,
        path: str,
        method: str = "GET",
        headers: Headers | None = None,
        body: bytes | None = None,
    ) -> Answer:
        """Return what the server answers; `headers` go before those that are usual."""
        connection = http.client.HTTPConnection(
            self.address.host, self.address.port, timeout=PATIENCE
        )
        try:
            connection.putrequest(method, path, skip_host=True)
            for name, value in {"Host": self.address.authority, **(headers or {})}.items():
                connection.putheader(name, value)
            if body is not None:
                connection.putheader("Content-Length", str(len(body)))
            connection.endheaders(body)
            answer = connection.getresponse()
            return Answer(answer.status, answer.headers, answer.read())
        finally:
            connection.close()

    def publish(self, joint: JointMap, maps: tuple[RobotMap, ...] = ()) -> None:
        """Store a version and hand it over, as the coordinator does."""
        message = JointMapMessage.pack(joint, self.store.series)
        self.store.add_version(joint.version, 1000.0 + joint.version, encode(message))
        self.feed.show_version(joint.version, maps, message)

    @contextmanager
    def events(self, headers: Headers | None = None) -> Iterator[Iterator[dict[str, str]]]:
        """Give the events that the server sends, as they come."""
        connection = http.client.HTTPConnection(
            self.address.host, self.address.port, timeout=PATIENCE
        )
        connection.request("GET", "/events", headers=dict(headers or {}))
        answer = connection.getresponse()
        try:
            assert answer.status == 200
            yield _events(answer)
        finally:
            answer.close()
            connection.close()


def _events(answer: http.client.HTTPResponse) -> Iterator[dict[str, str]]:
    fields: dict[str, str] = {}
    for line in answer:
        name, _, value = line.decode().rstrip("\n").partition(": ")
        if name:
            fields[name] = value
        elif "event" in fields:
            yield fields
            fields = {}


@pytest.fixture
def page(tmp_path: Path) -> Iterator[Page]:
    """Return a page of a store in which there is nothing yet."""
    with served(tmp_path) as page:
        yield page


@contextmanager
def served(folder: Path) -> Iterator[Page]:
    """Serve a page of a new store in `folder`."""
    feed = Feed()
    with (
        Store(folder / "store.sqlite", "team") as store,
        live_page(HttpAddress("127.0.0.1", 0), "team", store, Config(), feed, TOKEN) as address,
    ):
        yield Page(address, store, feed)


def make_joint(
    version: int, lines: LineMap, *, reason: str = "40 m of wall in common", **robots: float
) -> JointMap:
    """Return a version with one component of `lines`, each robot's at its x [m]."""
    places = {f"{name}/0": np.array([x, 0.0, 0.0]) for name, x in robots.items()}
    component = JointComponent(places, 0.97, lines, np.ones(len(lines.segments)))
    names = list(places)
    alignments = tuple(
        Alignment(names[0], name, places[name], "accepted", 0.97, Reason.words(reason))
        for name in names[1:]
    )
    return JointMap(version, (component,), alignments)


def make_pose(robot: str, x: float, *, found: bool = True) -> PoseMessage:
    """Return a robot's word that it is at `x` [m] of its component 0."""
    return PoseMessage(
        robot=robot, boot="b", stamp=None, sent=9.0, scan_index=0, found=found,
        component=f"{robot}/0", pose=(x, 0.0, 0.0), covariance=(0.0,) * 6,
    )  # fmt: skip


@pytest.fixture
def lines(make_map: MakeMap) -> LineMap:
    """Return the walls of a room."""
    return make_map("a").lines(0).moved(se2.IDENTITY)
