"""Maps as files for other programs; the file's suffix says which."""

from collections.abc import Callable
from pathlib import Path

from mapweave.errors import FileError
from mapweave.geometry.arguments import check_kind
from mapweave.io.exporters import dxf, geojson, map_server, mcap, tum
from mapweave.maps import JointMap, RobotMap
from mapweave.pictures.picture import PICTURE_SUFFIXES, plot

WRITERS: dict[str, Callable[[RobotMap | JointMap, Path], None]] = {
    **dict.fromkeys(PICTURE_SUFFIXES, plot),
    **{form.SUFFIX: form.write for form in (geojson, dxf, map_server, tum, mcap)},
}
"""Suffix to what writes such a file, whole or not at all."""

EXPORT_SUFFIXES = tuple(WRITERS)


def export(some_map: RobotMap | JointMap, path: str | Path) -> None:
    """Write `some_map` to `path`, whole or not at all, in the format its suffix names.

    Parameters
    ----------
    some_map
        A robot's map or a joint map.
    path
        The file to write: ``.svg`` or ``.png`` for a picture, ``.geojson`` or ``.dxf`` for the
        geometry, ``.yaml`` for a grid (its cells in a ``.pgm`` beside it), ``.tum`` for a robot's
        path, ``.mcap`` for a recording of the drive in Foxglove.

    Raises
    ------
    FileError
        If `path` has another suffix, the map does not hold what it is to show, or it cannot be
        written.
    MissingExtraError
        If a package that it takes is not installed: matplotlib for pictures, ezdxf for DXF,
        foxglove-sdk for MCAP.
    ArgumentError
        If it is no map.
    """
    check_kind("some_map", some_map, RobotMap, JointMap)
    path = Path(path)
    check_export_suffix(path)
    WRITERS[path.suffix.lower()](some_map, path)


def check_export_suffix(path: Path) -> None:
    """Raise FileError unless `path` ends in a suffix that can be written."""
    if path.suffix.lower() not in WRITERS:
        known = ", ".join(EXPORT_SUFFIXES)
        raise FileError(path, f"expected its name to end in one of {known}")
