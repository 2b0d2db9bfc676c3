"""Which runs the coordinator holds, as a message."""

from typing import ClassVar

from pydantic import Field

from mapweave_protocol.wire.model import MAX_ALIGNMENTS, Count, Id, Message, WireModel


class WireRun(WireModel):
    """A run of a robot.

    Attributes
    ----------
    robot, boot
        Name it.
    last
        The number of its last component.
    """

    robot: Id
    boot: Id
    last: Count


class RunsMessage(Message):
    """The runs of all robots, those of a robot from its earliest on; forgotten ones as well."""

    letter: ClassVar[bytes] = b"r"
    format: ClassVar[str] = "runs"

    runs: tuple[WireRun, ...] = Field(max_length=MAX_ALIGNMENTS)
