"""Maps as GeoJSON (RFC 7946), for maps and figures in other programs.

One FeatureCollection; ``properties.kind`` tells what a feature is:

=============  ==========================  =========================================================
``kind``       geometry                    further properties
=============  ==========================  =========================================================
`polyline`     LineString of one segment,  ``support``, for a joint map ``confidence``: one number a
               else MultiLineString        segment; ``support_max``, ``confidence_min`` for styling
`free_space`   Polygon                     ``robot``, for a robot's own map
`trajectory`   LineString, Point of one    ``robot``, ``scan_index``, ``stamp`` [s] and ``theta``
               scan                        [rad]: one number a position
`robot`        Point: the origin of a      ``robot``, ``origin_of`` (its component, as ``a/0``) and
               robot's component           ``theta`` [rad], joint maps only
`mark`         Point                       ``label``, ``by``, ``time`` [s since 1970], ``id`` and
                                           ``marked_in`` (the robot's component, as ``a/0``)
=============  ==========================  =========================================================

Each has ``component``, in whose frame its coordinates are. GeoJSON presumes longitude and latitude
on Earth; these are metres in a frame that nobody has placed on Earth, as ``crs: null`` says in the
way of GeoJSON 2008 and ``frame`` in words. Programs must not reproject them.
"""

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from mapweave.atomic import replace_file
from mapweave.geometry.arrays import FloatArray, IntArray
from mapweave.maps import JointMap, RobotMap
from mapweave.marks import PlacedMark
from mapweave.pictures.scene import Scene, ScenePath, robot_of, scenes_of

SUFFIX = ".geojson"
Json: TypeAlias = dict[str, Any]

DECIMALS = 4  # of a metre, and of a radian: finer than any laser
FRAME_NOTE = "x y in metres in a local frame, each component in its own; not longitude and latitude"


def write(some_map: RobotMap | JointMap, path: Path) -> None:
    """Write `some_map` to `path`, whole or not at all.

    Raises
    ------
    FileError
        If it cannot be written.
    """
    collection = feature_collection(scenes_of(some_map))
    text = json.dumps(collection, allow_nan=False, separators=(",", ":"))
    with replace_file(path) as temporary:
        temporary.write_text(text + "\n", encoding="utf-8")


def feature_collection(scenes: Sequence[Scene]) -> Json:
    """Return `scenes` as one GeoJSON FeatureCollection, ready for `json.dumps`."""
    return {
        "type": "FeatureCollection",
        "crs": None,
        "frame": FRAME_NOTE,
        "components": [_component(scene) for scene in scenes],
        "features": [feature for scene in scenes for feature in _features(scene)],
    }


def _component(scene: Scene) -> Json:
    facts: Json = {"component": scene.name, "robots": list(scene.robots)}
    if scene.confidence is not None:
        facts["confidence"] = scene.confidence
    return facts


def _features(scene: Scene) -> list[Json]:
    joint = scene.confidence is not None
    floor: Json = {} if joint else {"robot": robot_of(scene.name)}
    return [
        *(
            _feature(scene, "free_space", _polygon(polygon), **floor)
            for polygon in scene.map.free_space
        ),
        *_polylines(scene),
        *(_trajectory(scene, path) for path in scene.paths),
        *(_robot(scene, name, pose) for name, pose in scene.robots.items() if joint),
        *(_mark(scene, mark) for mark in scene.marks),
    ]


def _feature(scene: Scene, kind: str, geometry: Json, **properties: object) -> Json:
    return {
        "type": "Feature",
        "geometry": geometry,
        "properties": {"kind": kind, "component": scene.name, **properties},
    }


def _polylines(scene: Scene) -> list[Json]:
    starts = np.flatnonzero(np.diff(scene.map.polyline)) + 1
    numbers = np.split(np.arange(len(scene.map.segments)), starts)
    return [_polyline(scene, of_one) for of_one in numbers if len(of_one)]


def _polyline(scene: Scene, numbers: IntArray) -> Json:
    support = scene.map.support[numbers]
    properties: Json = {"support": support.tolist(), "support_max": int(support.max())}
    if scene.segment_confidence is not None:
        confidence = scene.segment_confidence[numbers]
        properties["confidence"] = _numbers(confidence)
        properties["confidence_min"] = round(float(confidence.min()), DECIMALS)
    lines = _positions(scene.map.segments[numbers].reshape(-1, 2, 2))
    geometry = (
        {"type": "LineString", "coordinates": lines[0]}
        if len(lines) == 1
        else {"type": "MultiLineString", "coordinates": lines}
    )
    return _feature(scene, "polyline", geometry, **properties)


def _polygon(polygon: FloatArray) -> Json:
    """Return a closed ring, counter-clockwise as RFC 7946, 3.1.6 asks."""
    x, y = polygon.T
    twice_area = float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))
    ring = polygon if twice_area >= 0 else polygon[::-1]
    return {"type": "Polygon", "coordinates": [_positions(np.concatenate([ring, ring[:1]]))]}


def _trajectory(scene: Scene, path: ScenePath) -> Json:
    positions = _positions(path.pose[:, :2])
    geometry = (
        {"type": "Point", "coordinates": positions[0]}
        if len(positions) == 1
        else {"type": "LineString", "coordinates": positions}
    )
    return _feature(
        scene,
        "trajectory",
        geometry,
        robot=path.robot,
        scan_index=path.scan_index.tolist(),
        stamp=[None if math.isnan(stamp) else stamp for stamp in path.stamp.tolist()],
        theta=_numbers(path.pose[:, 2]),
    )


def _robot(scene: Scene, name: str, pose: FloatArray) -> Json:
    point = {"type": "Point", "coordinates": _positions(pose[:2])}
    theta = round(float(pose[2]), DECIMALS)
    return _feature(scene, "robot", point, robot=robot_of(name), origin_of=name, theta=theta)


def _mark(scene: Scene, mark: PlacedMark) -> Json:
    point = {"type": "Point", "coordinates": _positions(mark.position)}
    said = {"label": mark.label, "by": mark.by, "time": mark.time, "id": mark.id}
    return _feature(scene, "mark", point, **said, marked_in=mark.component)


def _positions(points: FloatArray) -> list[Any]:
    """Return (…, 2) `points` as nested lists; adding 0 turns -0.0 into 0.0."""
    return list((np.round(points, DECIMALS) + 0.0).tolist())


def _numbers(values: FloatArray) -> list[float]:
    return [round(value, DECIMALS) for value in values.tolist()]
