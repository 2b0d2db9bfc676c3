"""What travels between the processes of a mapweave team.

A team's maps in two lines::

    for joint in mapweave_protocol.joint_maps(team="rescue"):
        print(joint.version, len(joint.components))

``keys`` and ``messages`` say what is sent where, ``codec`` turns messages into bytes and back,
``assembler`` puts a robot's map together from what arrives, ``session`` opens Zenoh as mapweave
wants it, ``inbox`` reads what arrives, and ``asking`` puts questions to the coordinator.
"""

from mapweave_protocol.link.subscriber import alignments, joint_maps, robot_maps, statuses

__all__ = ["alignments", "joint_maps", "robot_maps", "statuses"]
