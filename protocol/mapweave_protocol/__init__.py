"""What travels between the processes of a mapweave team.

A team's maps in two lines::

    for joint in mapweave_protocol.joint_maps(team="rescue"):
        print(joint.version, len(joint.components))

``keys`` and ``messages`` say what is sent where, ``codec`` turns messages into bytes and back,
``assembler`` puts a robot's map together from what arrives, ``session`` opens Zenoh as mapweave
wants it, ``inbox`` reads what arrives, and ``asking`` puts questions to the coordinator.
"""

from typing import TYPE_CHECKING

from mapweave.lazy import lazy_names

if TYPE_CHECKING:
    from mapweave_protocol.link.subscriber import (
        alignments,
        joint_maps,
        poses,
        robot_maps,
        statuses,
    )

_SUBSCRIBER = "mapweave_protocol.link.subscriber"
_MODULES = dict.fromkeys(
    ("alignments", "joint_maps", "poses", "robot_maps", "statuses"), _SUBSCRIBER
)

if not TYPE_CHECKING:  # who checks types knows the names from above
    __getattr__, __dir__ = lazy_names(__name__, _MODULES)

__all__ = ["alignments", "joint_maps", "poses", "robot_maps", "statuses"]
