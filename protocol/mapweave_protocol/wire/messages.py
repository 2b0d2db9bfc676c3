"""The messages, and how they are made from and turned into the types of `mapweave.maps`.

A message that exists is valid: every length and number is checked when it is made, whether from
our own maps or from a stranger's bytes (`mapweave_protocol.wire.codec`).
"""

from mapweave_protocol.wire.alignment_message import AlignmentMessage, MapVersion
from mapweave_protocol.wire.joint_message import JointMapMessage
from mapweave_protocol.wire.joint_status_message import JointStatusMessage
from mapweave_protocol.wire.map_message import MapMessage
from mapweave_protocol.wire.pose_message import PoseMessage
from mapweave_protocol.wire.status_message import Compared, StatusMessage, Traffic

__all__ = [
    "AlignmentMessage",
    "Compared",
    "JointMapMessage",
    "JointStatusMessage",
    "MapMessage",
    "MapVersion",
    "PoseMessage",
    "StatusMessage",
    "Traffic",
]
