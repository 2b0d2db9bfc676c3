"""Maps as MCAP recordings that Foxglove shows; needs `foxglove-sdk`.

Topics: ``/walls``, from red to dark green by confidence, ``/free_space`` and ``/marks``
(``SceneUpdate``), an entity a component; ``/path/<robot>`` (``PosesInFrame``), the whole path;
and ``/tf`` (``FrameTransforms``), where the sensor was at each scan that has a stamp, so that
playing the recording drives the robot through its map. Frames are named after components, such as
``a/0``, and the sensor's ``a/0/sensor``; components that are not joined share no frame. What is of
the map as a whole is at the first stamp.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from mapweave.atomic import replace_file
from mapweave.errors import MissingExtraError
from mapweave.geometry.arrays import FloatArray
from mapweave.maps import JointMap, RobotMap
from mapweave.pictures.scene import Scene, ScenePath, scenes_of

if TYPE_CHECKING:
    from foxglove import Context
    from foxglove.messages import LinePrimitive, Pose, Quaternion, TextPrimitive, Timestamp

SUFFIX = ".mcap"
LAST_STAMP = 2.0**32 - 1  # [s] that the format's seconds hold
WALL, OUTLINE = 0.05, 0.01  # [m] thickness of lines
LETTERS = 0.3  # [m]
GREY = (0.6, 0.6, 0.6)


def write(some_map: RobotMap | JointMap, path: Path) -> None:
    """Write `some_map` to `path`, whole or not at all.

    Raises
    ------
    MissingExtraError
        If `foxglove-sdk` is not installed.
    FileError
        If it cannot be written.
    """
    try:
        from foxglove import Context, open_mcap
    except ImportError as error:
        raise MissingExtraError("an MCAP recording", "foxglove") from error
    scenes, context = scenes_of(some_map), Context()
    with (
        replace_file(path) as temporary,
        open_mcap(temporary, allow_overwrite=True, context=context),
    ):
        _Recording(context, _first_stamp(scenes)).add(scenes)


@dataclass(frozen=True, slots=True)
class _Recording:
    """Logs what is in scenes to a context; what has no time of its own at `start` [s]."""

    context: Context
    start: float

    def add(self, scenes: Sequence[Scene]) -> None:
        """Log them; drives in the order of their stamps."""
        self._lines(scenes)
        paths = [(scene, path) for scene in scenes for path in scene.paths]
        self._paths(paths)
        self._drives(paths)

    def _lines(self, scenes: Sequence[Scene]) -> None:
        """Log what is drawn of each scene."""
        from foxglove.channels import SceneUpdateChannel
        from foxglove.messages import SceneEntity, SceneUpdate

        drawn: dict[str, list[SceneEntity]] = {"/walls": [], "/free_space": [], "/marks": []}
        for scene in scenes:
            make = partial(
                SceneEntity, timestamp=_time(self.start), frame_id=_frame(scene), id=scene.name
            )
            drawn["/walls"].append(make(lines=_walls(scene)))
            drawn["/free_space"].append(make(lines=_free_space(scene)))
            drawn["/marks"].append(make(texts=_marks(scene)))
        for topic, entities in drawn.items():
            channel = SceneUpdateChannel(topic, context=self.context)
            channel.log(SceneUpdate(entities=entities), log_time=_nanoseconds(self.start))

    def _paths(self, paths: Sequence[tuple[Scene, ScenePath]]) -> None:
        from foxglove.channels import PosesInFrameChannel
        from foxglove.messages import PosesInFrame

        for robot in sorted({path.robot for _, path in paths}):
            channel = PosesInFrameChannel(f"/path/{robot}", context=self.context)
            for scene, path in paths:
                if path.robot == robot:
                    poses = [_pose(pose) for pose in path.pose]
                    told = PosesInFrame(
                        timestamp=_time(self.start), frame_id=_frame(scene), poses=poses
                    )
                    channel.log(told, log_time=_nanoseconds(self.start))

    def _drives(self, paths: Sequence[tuple[Scene, ScenePath]]) -> None:
        from foxglove.channels import FrameTransformsChannel
        from foxglove.messages import FrameTransform, FrameTransforms, Vector3

        channel = FrameTransformsChannel("/tf", context=self.context)
        rows = [
            (stamp, path.component, _frame(scene), pose)
            for scene, path in paths
            for stamp, pose in zip(path.stamp.tolist(), path.pose, strict=True)
            if _is_time(stamp)
        ]
        for stamp, component, frame, pose in sorted(rows, key=lambda row: row[:2]):
            transform = FrameTransform(
                timestamp=_time(stamp),
                parent_frame_id=frame,
                child_frame_id=f"{component}/sensor",
                translation=Vector3(x=pose[0], y=pose[1], z=0.0),
                rotation=_turned(pose[2]),
            )
            channel.log(FrameTransforms(transforms=[transform]), log_time=_nanoseconds(stamp))


def _walls(scene: Scene) -> list[LinePrimitive]:
    """Return the walls as one list of lines."""
    sure = scene.segment_confidence
    confidence = np.ones(len(scene.map.segments)) if sure is None else sure
    colours = [(0.9 * (1 - c), 0.6 * c, 0.0) for c in confidence.tolist() for _ in range(2)]
    return [_line("LineList", scene.map.segments.reshape(-1, 2), WALL, colours)]


def _free_space(scene: Scene) -> list[LinePrimitive]:
    """Return the outlines of free space, each a loop."""
    return [_line("LineLoop", ring, OUTLINE, [GREY] * len(ring)) for ring in scene.map.free_space]


def _marks(scene: Scene) -> list[TextPrimitive]:
    """Return the label of each mark where it lies."""
    from foxglove.messages import Color, Pose, TextPrimitive, Vector3

    return [
        TextPrimitive(
            pose=Pose(
                position=Vector3(x=mark.position[0], y=mark.position[1], z=0.0),
                orientation=_turned(0.0),
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


def _pose(pose: FloatArray) -> Pose:
    from foxglove.messages import Pose, Vector3

    return Pose(position=Vector3(x=pose[0], y=pose[1], z=0.0), orientation=_turned(pose[2]))


def _turned(theta: float) -> Quaternion:
    from foxglove.messages import Quaternion

    return Quaternion(x=0.0, y=0.0, z=math.sin(theta / 2), w=math.cos(theta / 2))


def _time(stamp: float) -> Timestamp:
    from foxglove.messages import Timestamp

    return Timestamp(*divmod(_nanoseconds(stamp), 10**9))


def _nanoseconds(stamp: float) -> int:
    return round(stamp * 1e6) * 1000  # what a stamp as a float holds is microseconds


def _is_time(stamp: float) -> bool:
    return 0 <= stamp <= LAST_STAMP  # False for NaN


def _first_stamp(scenes: Sequence[Scene]) -> float:
    """[s] the first of all; 0 where none is known."""
    stamps = (s for scene in scenes for path in scene.paths for s in path.stamp.tolist())
    return min((stamp for stamp in stamps if _is_time(stamp)), default=0.0)


def _frame(scene: Scene) -> str:
    """Return the name of a scene's frame: of the component that is its origin."""
    return next(iter(scene.robots))
