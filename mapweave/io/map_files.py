"""Reading and writing map files: ``MAP.json`` (one robot) and ``JOINT.json`` (the team).

Numbers are rounded to 0.1 mm and 1 µrad, far below what a laser resolves, to keep files compact.
"""

import json
import math
import reprlib
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike
from pydantic import ValidationError

from mapweave.atomic import replace_file
from mapweave.errors import ID_IN_WORDS, FileError
from mapweave.evidence import RunnerUp
from mapweave.geometry.arguments import check_kind
from mapweave.geometry.arrays import FloatArray
from mapweave.ids import ID_PATTERN
from mapweave.io.annotations import listed, mark_content, order_content, placed_mark_content
from mapweave.io.map_schema import JOINT_FORMAT, MAP_FORMAT, HeaderFile, JointFile, MapFile
from mapweave.io.readers.streams import DamagedStreamError, UnusableArchiveError, read_blocks
from mapweave.maps import (
    Alignment,
    JointComponent,
    JointMap,
    LineMap,
    MadeWith,
    RobotMap,
    Submap,
    Trajectory,
)
from mapweave.reasons import Reason, Status
from mapweave.scan.coverage import coverage
from mapweave.text import in_words

_NO_ID = f"String should match pattern '{ID_PATTERN}'"  # as the library says it that checks
_EXPECTED = f"expected a map file ({MAP_FORMAT} or {JOINT_FORMAT})"
METRES, _RADIANS, _SECONDS, _RATIOS = 4, 6, 6, 6
"""Decimals that are written of each kind of number."""

_File = TypeVar("_File", HeaderFile, MapFile, JointFile)
T = TypeVar("T")


def read_map(path: str | Path) -> RobotMap:
    """Return the robot map in the file at `path`, which may be gzipped.

    Raises
    ------
    FileError
        If it cannot be read, or is not a robot map in every field.
    """
    source = Path(path)
    return _check(source, _content(source), MapFile).to_map()


def read_joint(path: str | Path) -> JointMap:
    """Return the joint map in the file at `path`, which may be gzipped.

    Raises
    ------
    FileError
        If it cannot be read, or is not a joint map in every field.
    """
    source = Path(path)
    return _check(source, _content(source), JointFile).to_map()


def load(path: str | Path) -> RobotMap | JointMap:
    """Return the robot map or joint map in the file at `path`, whichever its format says.

    Parameters
    ----------
    path
        ``MAP.json`` or ``JOINT.json``, which may be gzipped; its content tells, not its name.

    Raises
    ------
    FileError
        If it cannot be read, or is neither in every field.
    """
    source = Path(path)
    content = _content(source)
    if _check(source, content, HeaderFile).format == MAP_FORMAT:
        return _check(source, content, MapFile).to_map()
    return _check(source, content, JointFile).to_map()


def save(some_map: RobotMap | JointMap, path: str | Path) -> None:
    """Write a robot's map or a joint map to `path`, as `load` reads it; whole or not at all.

    Parameters
    ----------
    some_map
        The map.
    path
        The file: ``MAP.json`` or ``JOINT.json``, its numbers rounded to 0.1 mm and 1 µrad.

    Raises
    ------
    FileError
        If it cannot be written.
    ArgumentError
        If it is no map.
    """
    check_kind("some_map", some_map, RobotMap, JointMap)
    if isinstance(some_map, RobotMap):
        write_map(path, some_map)
    else:
        write_joint(path, some_map)


def write_map(path: str | Path, robot_map: RobotMap) -> None:
    """Write `robot_map` to `path`, whole or not at all.

    Raises
    ------
    FileError
        If it cannot be written.
    """
    content = {
        "format": MAP_FORMAT,
        "robot": robot_map.robot,
        "boot": robot_map.boot,
        "version": robot_map.version,
        **_made_with(robot_map.made_with),
        "submaps": [_submap(submap) for submap in robot_map.submaps],
        **listed("marks", map(mark_content, robot_map.marks)),
    }
    _write(path, content)


def write_joint(path: str | Path, joint: JointMap) -> None:
    """Write `joint` to `path`, whole or not at all.

    Raises
    ------
    FileError
        If it cannot be written.
    """
    _write(path, joint_content(joint))


def joint_content(joint: JointMap, *, searched: bool = True) -> dict[str, Any]:
    """Return what is in the file of `joint`, for `json.dumps`; on request without coverage.

    What was searched takes longer to work out than all the rest.
    """
    components = [component_content(component, searched=searched) for component in joint.components]
    return {
        "format": JOINT_FORMAT,
        "version": joint.version,
        **_made_with(joint.made_with),
        "alignments": [alignment_content(alignment) for alignment in joint.alignments],
        "components": components,
        **listed("orders", map(order_content, joint.orders)),
    }


def _content(path: Path) -> bytes:
    """Return what is in the file, unpacked."""
    try:
        with path.open("rb") as file:
            return b"".join(read_blocks(file))
    except OSError as error:
        raise FileError(path, f"cannot be read ({error.strerror}); {_EXPECTED}") from error
    except (DamagedStreamError, UnusableArchiveError) as error:
        raise FileError(path, f"{error}; {_EXPECTED}") from error


def _check(path: Path, content: bytes, model: type[_File]) -> _File:
    try:
        return model.model_validate_json(content)
    except ValidationError as error:
        raise FileError(path, _first_problem(error)) from error


def _first_problem(error: ValidationError) -> str:
    """Return where the first problem is, what it is and what was found: ``submaps[0].pose: …``."""
    problem = error.errors(include_url=False, include_context=False)[0]
    message = in_words(problem).replace(_NO_ID, f"expected {ID_IN_WORDS}")
    found = problem["input"]
    if isinstance(found, str | float | int) and problem["loc"]:
        message += f", found {reprlib.repr(found)}"
    place = "".join(_step(step) for step in problem["loc"]).removeprefix(".")
    if not place or problem["type"] == "missing":
        message += f"; {_EXPECTED}"
    return f"{place}: {message}" if place else message


def _step(step: int | str) -> str:
    """Return a step on the way to a field; what the file made up itself is quoted."""
    if step == "[key]":  # pydantic's word for: not the value but its name.
        return ""
    if isinstance(step, str) and step.isidentifier():
        return f".{step}"
    return f"[{reprlib.repr(step)}]"


def _write(path: str | Path, content: object) -> None:
    with replace_file(path) as temporary:
        text = json.dumps(content, separators=(",", ":"), allow_nan=False)
        temporary.write_text(text + "\n", encoding="utf-8")


def _made_with(made_with: MadeWith | None) -> dict[str, object]:
    """Return the field, where it is known: all digits of a configuration count."""
    return {} if made_with is None else {"made_with": asdict(made_with)}


def _submap(submap: Submap) -> dict[str, object]:
    return {
        "id": submap.id,
        "component": submap.component,
        "pose": _pose(submap.pose),
        **_line_map(submap.map),
        "trajectory": _trajectory(submap.trajectory),
        **_uncertainty(submap.trajectory),
    }


def _trajectory(trajectory: Trajectory) -> list[list[object]]:
    rows = zip(trajectory.scan_index, trajectory.stamp, trajectory.pose, strict=True)
    return [[int(index), _number(stamp, _SECONDS), *_pose(pose)] for index, stamp, pose in rows]


def _uncertainty(trajectory: Trajectory) -> dict[str, object]:
    """Return the rows beside those of the trajectory, where they are known."""
    if trajectory.uncertainty is None:
        return {}
    return {"uncertainty": np.round(trajectory.uncertainty, METRES).tolist()}


def _line_map(lines: LineMap) -> dict[str, object]:
    return {
        "polylines": _by_polyline(lines, _metres(lines.segments)),
        "support": _by_polyline(lines, lines.support.tolist()),
        "free_space": _polygons(lines.free_space),
    }


def _by_polyline(lines: LineMap, values: list[T]) -> list[list[T]]:
    """Split `values`, one for each segment, as the segments are split into polylines."""
    starts = (np.flatnonzero(np.diff(lines.polyline)) + 1).tolist()
    ends = [*starts, len(values)] if values else []
    return [values[start:end] for start, end in zip([0, *starts], ends, strict=False)]


def _polygons(rings: Sequence[FloatArray]) -> list[list[list[float]]]:
    """Return the corners of all `rings`, rounded at once: there are hundreds."""
    corners = _metres(np.concatenate([np.empty((0, 2)), *rings]))
    ends = np.cumsum([len(ring) for ring in rings], dtype=np.int64).tolist()
    return [corners[end - len(ring) : end] for ring, end in zip(rings, ends, strict=True)]


def alignment_content(alignment: Alignment) -> dict[str, object]:
    """Return one of the ``alignments`` of a joint map's file."""
    return {
        "reference": alignment.reference,
        "other": alignment.other,
        "transform": _pose(alignment.transform),
        "confidence": _number(alignment.confidence, _RATIOS),
        "decision": alignment.decision,
        "reason": alignment.reason,
        "evidence": _ratios(alignment.evidence.by_name()),
        "runner_up": _runner_up(alignment.runner_up),
        **_status(alignment.status),
        "cause": _cause(alignment.cause),
        "anchors": [[p.reference, p.other, *_pose(p.transform)] for p in alignment.places],
        "at": [_metres(place.at) for place in alignment.places],
    }


def _runner_up(runner_up: RunnerUp | None) -> dict[str, object] | None:
    if runner_up is None:
        return None
    transform = [_number(value, _RATIOS) for value in runner_up.transform]
    return {"transform": transform, **_ratios(runner_up.by_name())}


def _status(status: Status | None) -> dict[str, object]:
    if status is None:
        return {"status": None, "set_aside_by": [], "revoked_in": None}
    return {
        "status": status.kind,
        "set_aside_by": status.set_aside_by,
        "revoked_in": status.revoked_in,
    }


def _cause(cause: Reason) -> dict[str, object]:
    """Return the kind and, beside it, its numbers: in full, as the sentence is made of them."""
    numbers = {n: float(v) if math.isfinite(v) else None for n, v in cause.numbers.items()}
    text = {"text": cause.text} if cause.text else {}
    found = {} if cause.found is None else {"found": _cause(cause.found)}
    return {"kind": cause.kind, **numbers, **text, **found}


def coverage_content(lines: LineMap) -> dict[str, Any]:
    """Return the fields of a joint component that tell what was searched."""
    found = coverage(lines)
    return {
        "explored_m2": round(found.explored, 1),
        "frontiers": [np.round(line, METRES).tolist() for line in found.frontiers],
    }


def component_content(component: JointComponent, *, searched: bool = True) -> dict[str, Any]:
    """Return one of the ``components`` of a joint map's file; `searched` as in `joint_content`."""
    confidences = np.round(component.segment_confidence, METRES).tolist()
    return {
        "robots": {name: _pose(pose) for name, pose in component.robots.items()},
        "confidence": _number(component.confidence, _RATIOS),
        **_line_map(component.map),
        "segment_confidence": _by_polyline(component.map, confidences),
        **(coverage_content(component.map) if searched else {}),
        **listed("marks", map(placed_mark_content, component.marks)),
    }


def _pose(pose: ArrayLike) -> list[float]:
    x, y, theta = np.asarray(pose, dtype=float).tolist()
    return [round(x, METRES), round(y, METRES), round(theta, _RADIANS)]


def _metres(points: FloatArray) -> list[list[float]]:
    rounded: list[list[float]] = np.round(points, METRES).tolist()
    return rounded


def _number(value: float, decimals: int) -> float | None:
    return round(float(value), decimals) if math.isfinite(value) else None


def _ratios(numbers: Mapping[str, float]) -> dict[str, float | None]:
    """Return `numbers` as JSON can hold them: ``null`` for what is not finite."""
    return {name: _number(number, _RATIOS) for name, number in numbers.items()}
