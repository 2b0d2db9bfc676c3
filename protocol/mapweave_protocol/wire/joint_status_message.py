"""How far the coordinator is and what it holds, as a message: who sees a lack sends it again."""

from typing import ClassVar

from pydantic import Field

from mapweave_protocol.wire.alignment_message import MapVersion
from mapweave_protocol.wire.model import MAX_ALIGNMENTS, Count, Id, Message, Number
from mapweave_protocol.wire.status_message import MAX_PEERS


class JointStatusMessage(Message):
    """How far the coordinator is.

    Attributes
    ----------
    boot
        Of this start of the coordinator.
    stamp
        When it was said [s since 1970].
    series, version
        The latest version of the joint map: 0 when there is none yet.
    pending
        Whether something was received that is in no version yet.
    maps
        Which state of each robot's map is held.
    alignments
        For each pair of robots whose alignments are held, of which states of the maps.
    """

    kind: ClassVar[bytes] = b"c"
    format: ClassVar[str] = "coordinator status"

    boot: Id
    stamp: Number
    series: Id
    version: Count
    pending: bool
    maps: tuple[MapVersion, ...] = Field(default=(), max_length=MAX_PEERS)
    alignments: tuple[tuple[MapVersion, MapVersion], ...] = Field(
        default=(), max_length=MAX_ALIGNMENTS
    )
