"""Maps as DXF drawings (R2010, metres), for programs of architects; needs `ezdxf`.

The layers of a component are ``a_0 walls``, ``a_0 free space`` and ``a_0 path``, or for a joint
component ``a_0 + b_0 walls`` and so on, ``robot a_0`` with a point at the origin of each robot's
own component, and ``a_0 marks`` with a point and its label for each mark on what that robot mapped:
a slash is not allowed in their names. Each component is drawn in its own
frame, so that several lie over each other: switch layers off.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from mapweave.atomic import replace_file
from mapweave.errors import MissingExtraError
from mapweave.maps import JointMap, RobotMap
from mapweave.pictures.scene import Scene, scenes_of

if TYPE_CHECKING:
    from ezdxf.document import Drawing

SUFFIX = ".dxf"
WALL_COLOUR, FREE_COLOUR, PATH_COLOUR, ROBOT_COLOUR, MARK_COLOUR = 7, 9, 3, 1, 6  # AutoCAD's index
LABEL_HEIGHT = 0.25  # [m]


def write(some_map: RobotMap | JointMap, path: Path) -> None:
    """Write `some_map` to `path`, whole or not at all.

    Raises
    ------
    MissingExtraError
        If `ezdxf` is not installed.
    FileError
        If it cannot be written.
    """
    try:
        from ezdxf.filemanagement import new
        from ezdxf.units import M as METRES
    except ImportError as error:
        raise MissingExtraError("a DXF drawing", "dxf") from error
    with _without_dates():
        drawing = new("R2010", units=METRES)
        for scene in scenes_of(some_map):
            _draw(drawing, scene)
        with replace_file(path) as temporary:
            drawing.saveas(temporary)


@contextmanager
def _without_dates() -> Iterator[None]:
    """Have `ezdxf` write no date and no random id, so that the same map gives the same bytes."""
    from ezdxf._options import options

    before = options.write_fixed_meta_data_for_testing
    options.write_fixed_meta_data_for_testing = True
    try:
        yield
    finally:
        options.write_fixed_meta_data_for_testing = before


def layer_name(component: str) -> str:
    """Return `component`, such as ``a/0 + b/0``, as layers may be named."""
    return component.replace("/", "_")


def _draw(drawing: Drawing, scene: Scene) -> None:
    name, space = layer_name(scene.name), drawing.modelspace()
    if not np.isfinite(scene.map.segments).all():
        raise ValueError(f"{scene.name}: a wall has a coordinate that is NaN or infinite")
    walls = _layer(drawing, f"{name} walls", WALL_COLOUR)
    floor = _layer(drawing, f"{name} free space", FREE_COLOUR)
    for x1, y1, x2, y2 in scene.map.segments.tolist():
        space.add_line((x1, y1), (x2, y2), dxfattribs=walls)
    for polygon in scene.map.free_space:
        space.add_lwpolyline(polygon.tolist(), close=True, dxfattribs=floor)
    for part in scene.paths:
        path = _layer(drawing, f"{layer_name(part.component)} path", PATH_COLOUR)
        space.add_lwpolyline(part.pose[:, :2].tolist(), dxfattribs=path)
    for robot, (x, y, _) in scene.robots.items():
        start = _layer(drawing, f"robot {layer_name(robot)}", ROBOT_COLOUR)
        space.add_point((x, y), dxfattribs=start)
    for mark in scene.marks:
        layer = _layer(drawing, f"{layer_name(mark.component)} marks", MARK_COLOUR)
        place = tuple(mark.position.tolist())
        space.add_point(place, dxfattribs=layer)
        space.add_text(mark.label, height=LABEL_HEIGHT, dxfattribs={**layer, "insert": place})


def _layer(drawing: Drawing, name: str, colour: int) -> dict[str, str]:
    """Return what puts an entity on the layer `name`, which is made where it is missing."""
    if name not in drawing.layers:
        drawing.layers.add(name, color=colour)
    return {"layer": name}
