"""Maps as MCAP recordings that Foxglove shows; needs `foxglove-sdk`.

Topics: ``/walls``, from red to dark green by confidence, ``/free_space`` and ``/marks``
(``SceneUpdate``), an entity a component; ``/path/<robot>`` (``PosesInFrame``), the whole path;
and ``/tf`` (``FrameTransforms``), where the sensor was at each scan that has a stamp, so that
playing the recording drives the robot through its map. Frames are named after components, such as
``a/0``, and the sensor's ``a/0/sensor``; components that are not joined share no frame. What is of
the map as a whole is at the first stamp.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from mapweave.atomic import replace_file
from mapweave.errors import MissingExtraError
from mapweave.io.exporters.foxglove_scenes import (
    frame_of,
    is_time,
    nanoseconds,
    pose_message,
    scene_updates,
    sensor_frame,
    timestamp,
    transform_message,
)
from mapweave.maps import JointMap, RobotMap
from mapweave.pictures.scene import Scene, ScenePath, scenes_of

if TYPE_CHECKING:
    from foxglove import Context

SUFFIX = ".mcap"


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

        for topic, update in scene_updates(scenes, self.start).items():
            channel = SceneUpdateChannel(topic, context=self.context)
            channel.log(update, log_time=nanoseconds(self.start))

    def _paths(self, paths: Sequence[tuple[Scene, ScenePath]]) -> None:
        from foxglove.channels import PosesInFrameChannel
        from foxglove.messages import PosesInFrame

        for robot in sorted({path.robot for _, path in paths}):
            channel = PosesInFrameChannel(f"/path/{robot}", context=self.context)
            for scene, path in paths:
                if path.robot == robot:
                    poses = [pose_message(pose) for pose in path.pose]
                    told = PosesInFrame(
                        timestamp=timestamp(self.start), frame_id=frame_of(scene), poses=poses
                    )
                    channel.log(told, log_time=nanoseconds(self.start))

    def _drives(self, paths: Sequence[tuple[Scene, ScenePath]]) -> None:
        from foxglove.channels import FrameTransformsChannel

        channel = FrameTransformsChannel("/tf", context=self.context)
        rows = [
            (stamp, path.component, frame_of(scene), pose)
            for scene, path in paths
            for stamp, pose in zip(path.stamp.tolist(), path.pose, strict=True)
            if is_time(stamp)
        ]
        for stamp, component, frame, pose in sorted(rows, key=lambda row: row[:2]):
            told = transform_message(stamp, frame, sensor_frame(component), pose)
            channel.log(told, log_time=nanoseconds(stamp))


def _first_stamp(scenes: Sequence[Scene]) -> float:
    """[s] the first of all; 0 where none is known."""
    stamps = (s for scene in scenes for path in scene.paths for s in path.stamp.tolist())
    return min((stamp for stamp in stamps if is_time(stamp)), default=0.0)
