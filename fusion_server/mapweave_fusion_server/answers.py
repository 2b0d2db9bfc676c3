"""What the store says to a query: payloads, or why there is none."""

from collections.abc import Iterable, Iterator
from itertools import islice

from mapweave.errors import MapweaveError
from mapweave.maps import parse_component
from mapweave_fusion_server.store import Store
from mapweave_protocol.wire.codec import decode, encode
from mapweave_protocol.wire.messages import MapMessage, OrderMessage, OrdersMessage, RunsMessage
from mapweave_protocol.wire.orders.runs_message import WireRun
from mapweave_protocol.wire.queries import JointQuery


class NothingToAnswerError(MapweaveError):
    """A query that is in order, about something that is not there."""


def answer(store: Store, parameters: str) -> Iterator[bytes]:
    """Yield the payloads that answer the selector's `parameters`.

    Raises
    ------
    MessageError
        If `parameters` are no query.
    NothingToAnswerError
        If what is asked for is not there.
    """
    query = JointQuery.parse(parameters)
    if query.since is not None:
        yield from islice(store.versions_since(query.since), query.limit)
    elif query.robot is not None:
        yield _found(store.map_of(query.robot), f"no map of robot {query.robot}")
    elif query.component is not None:
        robot, number = parse_component(query.component)
        held = store.map_with_component(robot, number)
        yield _found(held, f"no map with a component {query.component}")
    elif query.runs is not None:
        yield encode(runs_of(store.last_maps()))
    elif query.orders is not None:
        yield encode(OrdersMessage(orders=tuple(map(_order, store.orders()))))
    elif query.version is not None:
        latest = store.latest_version
        missing = f"no version {query.version} of the joint map; there are 1 to {latest}"
        yield _found(store.version(query.version), missing)
    else:
        yield _found(store.version(store.latest_version), "no joint map: there is none yet")


def runs_of(payloads: Iterable[bytes]) -> RunsMessage:
    """Return the runs of which these are the maps."""
    maps = [decode(MapMessage, payload) for payload in payloads]
    runs = tuple(
        WireRun(
            robot=message.robot,
            boot=message.boot,
            version=message.version,
            components=tuple(sorted({place.component for place in message.changes.places})),
        )
        for message in maps
    )
    return RunsMessage(runs=runs)


def _order(payload: bytes) -> OrderMessage:
    return decode(OrderMessage, payload)


def _found(message: bytes | None, otherwise: str) -> bytes:
    if message is None:
        raise NothingToAnswerError(otherwise)
    return message
