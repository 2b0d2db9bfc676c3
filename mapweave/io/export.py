"""Maps as files for other programs; the file's suffix says which."""

import json
from pathlib import Path

from mapweave.atomic import replace_file
from mapweave.errors import FileError
from mapweave.io.exporters.geojson import feature_collection
from mapweave.maps import JointMap, RobotMap
from mapweave.pictures.picture import PICTURE_SUFFIXES, plot
from mapweave.pictures.scene import Scene, joint_scenes, robot_scenes

EXPORT_SUFFIXES = (*PICTURE_SUFFIXES, ".geojson")
PLANNED_SUFFIXES = (".dxf", ".yaml")


def export(some_map: RobotMap | JointMap, path: str | Path) -> None:
    """Write `some_map` to `path`, whole or not at all, in the format its suffix names.

    Parameters
    ----------
    some_map
        A robot's map or a joint map.
    path
        The file to write: ``.svg`` or ``.png`` for a picture, ``.geojson`` for the geometry.

    Raises
    ------
    FileError
        If `path` has another suffix or cannot be written.
    MissingExtraError
        If a picture is asked for and matplotlib is not installed.
    """
    path = Path(path)
    check_export_suffix(path)
    if path.suffix.lower() in PICTURE_SUFFIXES:
        plot(some_map, path)
    else:
        _write_geojson(some_map, path)


def check_export_suffix(path: Path) -> None:
    """Raise FileError unless `path` ends in a suffix that can be written."""
    suffix = path.suffix.lower()
    if suffix in EXPORT_SUFFIXES:
        return
    known = ", ".join(EXPORT_SUFFIXES)
    if suffix in PLANNED_SUFFIXES:
        raise FileError(path, f"{suffix} cannot be written yet; there are {known}")
    raise FileError(path, f"expected its name to end in one of {known}")


def _write_geojson(some_map: RobotMap | JointMap, path: Path) -> None:
    text = json.dumps(feature_collection(_scenes(some_map)), allow_nan=False, separators=(",", ":"))
    with replace_file(path) as temporary:
        temporary.write_text(text + "\n", encoding="utf-8")


def _scenes(some_map: RobotMap | JointMap) -> list[Scene]:
    return robot_scenes(some_map) if isinstance(some_map, RobotMap) else joint_scenes(some_map)
