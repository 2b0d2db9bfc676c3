"""How far a robot is, as a message."""

from collections.abc import Mapping, Sequence
from typing import ClassVar, Literal, TypeAlias, get_args

from pydantic import Field

from mapweave_protocol.wire.alignment_message import MapVersion
from mapweave_protocol.wire.budget import KIB, MIB, Budget
from mapweave_protocol.wire.model import Count, Id, Label, Message, Number, WireModel
from mapweave_protocol.wire.orders.order_message import DIGEST_SIZE

MAX_PEERS = 1024
MAX_REFUSED = 64  # kinds of several senders


class Compared(WireModel):
    """From which states of the maps a pair's alignment was last published."""

    own_version: Count
    peer_boot: Id
    peer_version: Count


class Traffic(WireModel):
    """What was published of one kind."""

    messages: Count
    bytes: Count


Kind: TypeAlias = Literal["map", "alignment", "status", "pose", "mark"]
"""What a robot publishes."""


class StatusMessage(Message):
    """How far a robot is.

    Attributes
    ----------
    stamp
        When it was said [s since 1970].
    scans_total
        How many scans there are to come in all, where known.
    scans_skipped
        How many came faster than they could be mapped; none of a recording.
    scan_age
        How long one waited at most since the last status [s]; None of a recording.
    compared
        By peer, for the pairs this robot compared.
    holds
        Which state of each peer's map is held.
    sent
        What was published, by kind of message.
    orders
        Tells apart which orders of operators are held; nothing where none are.
    refused
        How many messages were refused, by who sent them and what they were, such as ``r2 map``.
    dropped
        How many found no room.
    """

    letter: ClassVar[bytes] = b"s"
    format: ClassVar[str] = "status"
    budget: ClassVar[Budget] = Budget(256 * KIB, 2 * MIB, 30_000)
    placed: ClassVar[Mapping[str, Sequence[str]]] = {"sent": get_args(Kind)}

    robot: Id
    boot: Id
    stamp: Number
    state: Literal["mapping", "finished"]
    scans_seen: Count
    scans_placed: Count
    scans_total: Count | None = None
    scans_skipped: Count = 0
    scan_age: Number | None = None
    components: Count
    submaps: Count
    map_version: Count
    compared: dict[Id, Compared] = Field(default_factory=dict, max_length=MAX_PEERS)
    holds: tuple[MapVersion, ...] = Field(default=(), max_length=MAX_PEERS)
    sent: dict[Kind, Traffic] = Field(default_factory=dict)
    orders: bytes = Field(default=b"", max_length=DIGEST_SIZE)
    refused: dict[Label, Count] = Field(default_factory=dict, max_length=MAX_REFUSED)
    dropped: Count = 0
