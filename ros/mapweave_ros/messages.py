"""Grids, markers and transforms as ROS 2 messages, by the definitions that `rosbags` brings."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from mapweave.errors import MissingExtraError
from mapweave.geometry.arrays import FloatArray
from mapweave.io.exporters.map_server import FREE, OCCUPIED, RESOLUTION, Grid
from mapweave.marks import PlacedMark

if TYPE_CHECKING:
    from rosbags.typesys.store import Typestore

OCCUPANCY_GRID = "nav_msgs/msg/OccupancyGrid"
MARKER_ARRAY = "visualization_msgs/msg/MarkerArray"
TF_MESSAGE = "tf2_msgs/msg/TFMessage"
LINES, TEXT, CLEAR = 5, 9, 3  # kinds of markers: LINE_LIST, TEXT_VIEW_FACING; action DELETEALL

Colour: TypeAlias = tuple[float, float, float]


@dataclass(frozen=True, slots=True, eq=False)
class Lines:
    """Segments to show, under a name that a viewer lists.

    Attributes
    ----------
    name
        Such as ``walls``.
    segments
        (n, 4) [m].
    colours
        (n, 3) red, green and blue, 0 to 1.
    """

    name: str
    segments: FloatArray
    colours: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Transform:
    """Where a frame is: the pose (3,) of `child` in `parent` at `stamp` [s since 1970]."""

    parent: str
    child: str
    pose: FloatArray
    stamp: float


@cache
def _store() -> "Typestore":
    """Return the definitions; those used here are the same from Humble on."""
    try:
        from rosbags.typesys import Stores, get_typestore
    except ImportError as error:
        raise MissingExtraError("a ROS 2 network", "ros2") from error
    return get_typestore(Stores.ROS2_JAZZY)


class Messages:
    """Makes messages as they go over the wire.

    Raises
    ------
    MissingExtraError
        If `rosbags` is not installed.
    """

    def __init__(self) -> None:
        self._store = _store()

    def type_hash(self, kind: str) -> str:
        """Return the hash of a type, as REP 2016 has it."""
        return str(self._store.hash_rihs01(kind))

    def grid(self, grid: Grid, frame: str, stamp: float) -> bytes:
        """Return an ``OccupancyGrid``: 100 is a wall, 0 is free, -1 is unknown."""
        rows, columns = grid.cells.shape
        data = np.full(grid.cells.shape, -1, dtype=np.int8)
        data[grid.cells == FREE], data[grid.cells == OCCUPIED] = 0, 100
        info = self._make(
            "nav_msgs/msg/MapMetaData",
            map_load_time=self._time(stamp),
            resolution=RESOLUTION,
            width=columns,
            height=rows,
            origin=self._pose(np.array([*grid.origin, 0.0])),
        )
        return self._encode(
            OCCUPANCY_GRID, header=self._header(frame, stamp), info=info, data=data.ravel()
        )

    def markers(
        self,
        lines: Sequence[Lines],
        labels: Sequence[tuple[str, str]],
        marks: Sequence[PlacedMark],
        frame: str,
        stamp: float,
    ) -> bytes:
        """Return a ``MarkerArray`` that replaces the one before it.

        Parameters
        ----------
        lines
            In `frame`.
        labels
            Robots and their frames, where each is shown by name.
        marks
            In `frame`, each shown by its label.
        """
        header = self._header(frame, stamp)
        markers = [self._marker(header, "", 0, LINES, action=CLEAR)]
        markers += [self._line_list(header, number, one) for number, one in enumerate(lines)]
        for number, (robot, own) in enumerate(labels):
            there = self._header(own, 0.0)  # wherever that is
            marker = self._marker(there, "robots", number, TEXT, text=robot, frame_locked=True)
            markers.append(marker)
        for number, mark in enumerate(marks):
            there = self._pose(np.array([*mark.position, 0.0]))
            markers.append(self._marker(header, "marks", number, TEXT, text=mark.label, pose=there))
        return self._encode(MARKER_ARRAY, markers=markers)

    def transforms(self, transforms: Sequence[Transform]) -> bytes:
        """Return a ``TFMessage``."""
        return self._encode(TF_MESSAGE, transforms=[self._transform(one) for one in transforms])

    def _line_list(self, header: object, number: int, lines: Lines) -> object:
        ends = lines.segments.reshape(-1, 2).tolist()
        colours = np.repeat(lines.colours, 2, axis=0).tolist()
        return self._marker(
            header,
            lines.name,
            number,
            LINES,
            points=[self._make("geometry_msgs/msg/Point", x=x, y=y, z=0.0) for x, y in ends],
            colors=[self._colour(red, green, blue) for red, green, blue in colours],
        )

    def _marker(
        self,
        header: object,
        name: str,
        number: int,
        kind: int,
        *,
        action: int = 0,
        text: str = "",
        pose: object = None,
        frame_locked: bool = False,
        points: Sequence[object] = (),
        colors: Sequence[object] = (),
    ) -> object:
        width = 0.05 if kind == LINES else 0.5  # [m] of a line, or of letters
        return self._make(
            "visualization_msgs/msg/Marker",
            header=header,
            ns=name,
            id=number,
            type=kind,
            action=action,
            pose=pose or self._pose(np.zeros(3)),
            scale=self._make("geometry_msgs/msg/Vector3", x=width, y=width, z=width),
            color=self._colour(0.1, 0.3, 0.9),
            lifetime=self._make("builtin_interfaces/msg/Duration", sec=0, nanosec=0),
            frame_locked=frame_locked,
            points=list(points),
            colors=list(colors),
            text=text,
            **self._without_textures(),
        )

    def _without_textures(self) -> dict[str, Any]:
        """Return the fields of a marker that has neither texture nor mesh."""
        nothing = np.zeros(0, dtype=np.uint8)
        image = self._make(
            "sensor_msgs/msg/CompressedImage",
            header=self._header("", 0.0),
            format="",
            data=nothing,
        )
        return {
            "texture_resource": "",
            "texture": image,
            "uv_coordinates": [],
            "mesh_resource": "",
            "mesh_file": self._make("visualization_msgs/msg/MeshFile", filename="", data=nothing),
            "mesh_use_embedded_materials": False,
        }

    def _transform(self, transform: Transform) -> object:
        pose = self._pose(transform.pose)
        x, y, _ = transform.pose.tolist()
        moved = self._make(
            "geometry_msgs/msg/Transform",
            translation=self._make("geometry_msgs/msg/Vector3", x=x, y=y, z=0.0),
            rotation=pose.orientation,
        )
        return self._make(
            "geometry_msgs/msg/TransformStamped",
            header=self._header(transform.parent, transform.stamp),
            child_frame_id=transform.child,
            transform=moved,
        )

    def _pose(self, pose: FloatArray) -> Any:  # noqa: ANN401 - made at run time
        x, y, theta = pose.tolist()
        return self._make(
            "geometry_msgs/msg/Pose",
            position=self._make("geometry_msgs/msg/Point", x=x, y=y, z=0.0),
            orientation=self._make(
                "geometry_msgs/msg/Quaternion",
                x=0.0,
                y=0.0,
                z=math.sin(theta / 2),
                w=math.cos(theta / 2),
            ),
        )

    def _colour(self, red: float, green: float, blue: float) -> object:
        return self._make("std_msgs/msg/ColorRGBA", r=red, g=green, b=blue, a=1.0)

    def _header(self, frame: str, stamp: float) -> object:
        return self._make("std_msgs/msg/Header", stamp=self._time(stamp), frame_id=frame)

    def _time(self, stamp: float) -> object:
        sec = math.floor(stamp)
        nanosec = min(int((stamp - sec) * 1e9), 999_999_999)
        return self._make("builtin_interfaces/msg/Time", sec=sec, nanosec=nanosec)

    def _make(self, kind: str, **fields: Any) -> Any:  # noqa: ANN401 - made at run time
        return self._store.types[kind](**fields)

    def _encode(self, kind: str, **fields: Any) -> bytes:  # noqa: ANN401
        return bytes(self._store.serialize_cdr(self._make(kind, **fields), kind))


def map_frame(robot: str) -> str:
    """Return the name of the frame of a robot's own map."""
    return f"{robot}/map"


def base_frame(robot: str) -> str:
    """Return the name of the frame of a robot that has none of its own."""
    return f"{robot}/base_link"


def sensor_frame(robot: str) -> str:
    """Return the name of the frame of what a robot's scans are taken with."""
    return f"{robot}/sensor"
