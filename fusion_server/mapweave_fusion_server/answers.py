"""What the store says to a query: payloads, or why there is none."""

from collections.abc import Iterator
from itertools import islice

from mapweave.errors import MapweaveError
from mapweave.maps import parse_component
from mapweave_fusion_server.store import Store
from mapweave_protocol.wire.codec import decode, encode
from mapweave_protocol.wire.messages import OrderMessage, OrdersMessage, RunsMessage
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
    if query.of is not None:
        yield from (
            store.maps_since(query.since)
            if query.of == "maps"
            else (store.alignments_since(query.since))
        )
    elif query.since is not None:
        yield from islice(store.versions_since(query.since), query.limit)
    elif query.robot is not None:
        yield _found(store.map_of(query.robot, query.boot), f"no map of robot {query.robot}")
    elif query.component is not None:
        robot, number = parse_component(query.component)
        held = store.map_with_component(robot, number)
        yield _found(held, f"no map with a component {query.component}")
    elif query.runs is not None:
        runs = (WireRun(robot=r, boot=b, last=last) for r, b, last in store.runs())
        yield encode(RunsMessage(runs=tuple(runs)))
    elif query.orders is not None:
        yield encode(OrdersMessage(orders=tuple(map(_order, store.orders()))))
    elif query.version is not None:
        latest = store.latest_version
        missing = f"no version {query.version} of the joint map; there are 1 to {latest}"
        yield _found(store.version(query.version), missing)
    else:
        yield _found(store.version(store.latest_version), "no joint map: there is none yet")


def _order(payload: bytes) -> OrderMessage:
    return decode(OrderMessage, payload)


def _found(message: bytes | None, otherwise: str) -> bytes:
    if message is None:
        raise NothingToAnswerError(otherwise)
    return message
