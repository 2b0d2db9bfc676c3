"""What Foxglove shows of a scene, as its messages; needs `foxglove-sdk`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from mapweave.geometry.arrays import FloatArray
from mapweave.pictures.scene import Scene

if TYPE_CHECKING:
    from foxglove.messages import (
        FrameTransforms,
        LinePrimitive,
        Pose,
        Quaternion,
        SceneUpdate,
        TextPrimitive,
        Timestamp,
    )

LAST_STAMP = 2.0**32 - 1  # [s] that the format's seconds hold
WALL, OUTLINE = 0.05, 0.01  # [m] thickness of lines
LETTERS = 0.3  # [m]
GREY = (0.6, 0.6, 0.6)


def scene_updates(
    scenes: Sequence[Scene], stamp: float, *, replacing: bool = False
) -> dict[str, SceneUpdate]:
    """Return what is drawn of each scene, by topic: ``/walls``, ``/free_space`` and ``/marks``.

    Parameters
    ----------
    stamp
        [s] since when that is so.
    replacing
        Whether all that was drawn before goes.
    """
    from foxglove.messages import (
        SceneEntity,
        SceneEntityDeletion,
        SceneEntityDeletionType,
        SceneUpdate,
    )

    drawn: dict[str, list[SceneEntity]] = {"/walls": [], "/free_space": [], "/marks": []}
    for scene in scenes:
        make = partial(
            SceneEntity, timestamp=timestamp(stamp), frame_id=frame_of(scene), id=scene.name
        )
        drawn["/walls"].append(make(lines=_walls(scene)))
        drawn["/free_space"].append(make(lines=_outlines(scene)))
        drawn["/marks"].append(make(texts=_labels(scene)))
    all_of_it = SceneEntityDeletion(timestamp=timestamp(stamp), type=SceneEntityDeletionType.All)
    gone = [all_of_it] if replacing else []
    return {
        topic: SceneUpdate(deletions=gone, entities=entities) for topic, entities in drawn.items()
    }


def transform_message(stamp: float, frame: str, child: str, pose: FloatArray) -> FrameTransforms:
    """Return that `child` is at `pose` (3,) [m, m, rad] in `frame` at `stamp` [s]."""
    from foxglove.messages import FrameTransform, FrameTransforms, Vector3

    transform = FrameTransform(
        timestamp=timestamp(stamp),
        parent_frame_id=frame,
        child_frame_id=child,
        translation=Vector3(x=pose[0], y=pose[1], z=0.0),
        rotation=turned(pose[2]),
    )
    return FrameTransforms(transforms=[transform])


def sensor_frame(component: str) -> str:
    """Return the name of the frame of the sensor of the robot in `component`."""
    return f"{component}/sensor"


def _walls(scene: Scene) -> list[LinePrimitive]:
    """Return the walls as one list of lines."""
    sure = scene.segment_confidence
    confidence = np.ones(len(scene.map.segments)) if sure is None else sure
    colours = [(0.9 * (1 - c), 0.6 * c, 0.0) for c in confidence.tolist() for _ in range(2)]
    return [_line("LineList", scene.map.segments.reshape(-1, 2), WALL, colours)]


def _outlines(scene: Scene) -> list[LinePrimitive]:
    """Return the outlines of free space, each a loop."""
    return [_line("LineLoop", ring, OUTLINE, [GREY] * len(ring)) for ring in scene.map.free_space]


def _labels(scene: Scene) -> list[TextPrimitive]:
    """Return the label of each mark where it lies."""
    from foxglove.messages import Color, Pose, TextPrimitive, Vector3

    return [
        TextPrimitive(
            pose=Pose(
                position=Vector3(x=mark.position[0], y=mark.position[1], z=0.0),
                orientation=turned(0.0),
            ),
            billboard=True,
            font_size=LETTERS,
            color=Color(r=0.8, g=0.1, b=0.1, a=1.0),
            text=mark.label,
        )
        for mark in scene.marks
    ]


def _line(
    kind: str, points: FloatArray, thickness: float, colours: Sequence[tuple[float, float, float]]
) -> LinePrimitive:
    from foxglove.messages import Color, LinePrimitive, LinePrimitiveLineType, Point3

    return LinePrimitive(
        type=getattr(LinePrimitiveLineType, kind),
        thickness=thickness,
        points=[Point3(x=x, y=y, z=0.0) for x, y in points.tolist()],
        colors=[Color(r=r, g=g, b=b, a=1.0) for r, g, b in colours],
    )


def pose_message(pose: FloatArray) -> Pose:
    """Return `pose` (3,) [m, m, rad]."""
    from foxglove.messages import Pose, Vector3

    return Pose(position=Vector3(x=pose[0], y=pose[1], z=0.0), orientation=turned(pose[2]))


def turned(theta: float) -> Quaternion:
    """Return a turn by `theta` [rad] about the vertical."""
    from foxglove.messages import Quaternion

    return Quaternion(x=0.0, y=0.0, z=math.sin(theta / 2), w=math.cos(theta / 2))


def timestamp(stamp: float) -> Timestamp:
    """Return `stamp` [s] as Foxglove has it."""
    from foxglove.messages import Timestamp

    return Timestamp(*divmod(nanoseconds(stamp), 10**9))


def nanoseconds(stamp: float) -> int:
    """Return `stamp` [s] in nanoseconds."""
    return round(stamp * 1e6) * 1000  # what a stamp as a float holds is microseconds


def is_time(stamp: float) -> bool:
    """Return whether Foxglove can say `stamp` [s]."""
    return 0 <= stamp <= LAST_STAMP  # False for NaN


def frame_of(scene: Scene) -> str:
    """Return the name of a scene's frame: of the component that is its origin."""
    return next(iter(scene.robots))
