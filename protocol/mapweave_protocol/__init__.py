"""What travels between the processes of a mapweave team.

``keys`` and ``messages`` say what is sent where, ``codec`` turns messages into bytes and back,
``assembler`` puts a robot's map together from what arrives, ``session`` opens Zenoh as mapweave
wants it, and ``subscriber`` gives the team's maps in two lines.
"""
