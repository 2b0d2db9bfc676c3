"""The messages, and how they are made from and turned into the types of `mapweave.maps`.

A message that exists is valid: every length and number is checked when it is made, whether from
our own maps or from a stranger's bytes (`mapweave_protocol.wire.codec`).
"""

from mapweave_protocol.wire.alignment_message import AlignmentMessage, MapVersion
from mapweave_protocol.wire.joint_message import JointMapMessage
from mapweave_protocol.wire.joint_status_message import JointStatusMessage
from mapweave_protocol.wire.map_message import MapMessage
from mapweave_protocol.wire.orders.marks_message import MarksMessage
from mapweave_protocol.wire.orders.order_message import OrderMessage, OrdersMessage
from mapweave_protocol.wire.orders.runs_message import RunsMessage
from mapweave_protocol.wire.pose_message import PoseMessage
from mapweave_protocol.wire.status_message import Compared, StatusMessage, Traffic

__all__ = [
    "AlignmentMessage",
    "Compared",
    "JointMapMessage",
    "JointStatusMessage",
    "MapMessage",
    "MapVersion",
    "MarksMessage",
    "OrderMessage",
    "OrdersMessage",
    "PoseMessage",
    "RunsMessage",
    "StatusMessage",
    "Traffic",
]
