"""mapweave: joint line maps of robot teams from raw 2D laser scans.

The library half: arrays in, arrays out; it knows no network and no clock. It implements
*Incremental Multi-Robot Mapping* (Latecki, Lakaemper, Sun, Wolter); "paper" in a docstring
means that text, and roman numerals are its sections.

A scan after the other becomes a robot's map, maps are aligned, and fused::

    mapper = mapweave.Mapper("a")
    for scan in mapweave.read_scans("a.log"):
        mapper.add(scan)
    joint = mapweave.fuse([mapper.finish(), mapweave.load("b.json")])
    mapweave.plot(joint, "joint.png")

The names below load what they need when they are first used. The paper's own pieces are in
`mapweave.scan` (the segments of a scan), `mapweave.lines` (generalized polylines, merging cost,
merged segment, main directions) and `mapweave.shape` (similarity, complexity, best match).
"""

from typing import TYPE_CHECKING

from mapweave.lazy import lazy_names

if TYPE_CHECKING:
    from mapweave.config import Config, Mapping, Robot, Sensor
    from mapweave.errors import MapweaveError
    from mapweave.fusion.align import align
    from mapweave.io.export import export
    from mapweave.io.map_files import load, save
    from mapweave.io.readers.scans import read_scans
    from mapweave.mapping.mapper import Mapper
    from mapweave.maps import Alignment, JointMap, RobotMap
    from mapweave.pictures.picture import plot
    from mapweave.scan.scan import Scan
    from mapweave.team.joint_map import fuse

_MODULES = {
    "Alignment": "mapweave.maps",
    "Config": "mapweave.config",
    "JointMap": "mapweave.maps",
    "Mapper": "mapweave.mapping.mapper",
    "Mapping": "mapweave.config",
    "MapweaveError": "mapweave.errors",
    "Robot": "mapweave.config",
    "RobotMap": "mapweave.maps",
    "Scan": "mapweave.scan.scan",
    "Sensor": "mapweave.config",
    "align": "mapweave.fusion.align",
    "export": "mapweave.io.export",
    "fuse": "mapweave.team.joint_map",
    "load": "mapweave.io.map_files",
    "plot": "mapweave.pictures.picture",
    "read_scans": "mapweave.io.readers.scans",
    "save": "mapweave.io.map_files",
}

if not TYPE_CHECKING:  # who checks types knows the names from above
    __getattr__, __dir__ = lazy_names(__name__, _MODULES)

__all__ = [
    "Alignment",
    "Config",
    "JointMap",
    "Mapper",
    "Mapping",
    "MapweaveError",
    "Robot",
    "RobotMap",
    "Scan",
    "Sensor",
    "align",
    "export",
    "fuse",
    "load",
    "plot",
    "read_scans",
    "save",
]
