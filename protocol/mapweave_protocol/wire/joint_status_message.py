"""How far the coordinator is and what it holds, as a message: who sees a lack sends it again."""

from typing import ClassVar

from pydantic import Field

from mapweave.maps import JointMap, parse_component
from mapweave_protocol.wire.alignment_message import MapVersion
from mapweave_protocol.wire.model import (
    MAX_ALIGNMENTS,
    ComponentName,
    Count,
    Id,
    JointTransform,
    Message,
    Number,
    WireModel,
    to_transform,
)
from mapweave_protocol.wire.orders.order_message import DIGEST_SIZE
from mapweave_protocol.wire.status_message import MAX_PEERS


class Place(WireModel):
    """Where a robot's component is in the joint map.

    Attributes
    ----------
    frame
        The component whose frame the joint frame is: the first in it, by name.
    pose
        [m, m, rad] joint frame.
    """

    frame: ComponentName
    pose: JointTransform


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
    frames
        Where each component of the latest version is: enough to say where a robot is in it.
    marks
        Which version of the marks of each run that made some is held.
    orders
        Tells apart which orders of operators are held; nothing where none are.
    """

    letter: ClassVar[bytes] = b"c"
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
    frames: dict[ComponentName, Place] = Field(default_factory=dict, max_length=MAX_ALIGNMENTS)
    marks: tuple[MapVersion, ...] = Field(default=(), max_length=MAX_PEERS)
    orders: bytes = Field(default=b"", max_length=DIGEST_SIZE)


def frames_of(joint: JointMap | None) -> dict[str, Place]:
    """Return the frames of `joint`, none where there is no joint map."""
    components = () if joint is None else joint.components
    return {
        name: Place(frame=min(one.robots, key=parse_component), pose=to_transform(pose))
        for one in components
        for name, pose in one.robots.items()
    }
