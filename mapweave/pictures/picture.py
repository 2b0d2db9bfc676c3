"""Pictures of maps, as png or svg, that a person recognises the building in.

The same map always gives the same bytes. Drawing needs matplotlib, the optional extra ``plot``.
"""

from collections.abc import Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType

from mapweave.atomic import replace_file
from mapweave.errors import FileError, MissingExtraError
from mapweave.geometry.arguments import check_kind
from mapweave.maps import JointMap, RobotMap
from mapweave.pictures.scene import Scene, joint_scenes, robot_of, robot_scenes, tell_confidence

PICTURE_SUFFIXES = (".svg", ".png")


def plot(
    some_map: RobotMap | JointMap,
    path: str | Path,
    maps: Mapping[str, RobotMap] | None = None,
    title: str | None = None,
) -> None:
    """Draw a robot's map, as `draw_map` does, or a joint map, as `draw_joint` does.

    Parameters
    ----------
    some_map
        The map.
    path
        The file to write, ``.svg`` or ``.png``; whole or not at all.
    maps
        Robot id to robot map: in a joint map they add the paths.
    title
        Its headline; names the robot or the version by default.

    Raises
    ------
    FileError
        If `path` has another suffix or cannot be written.
    MissingExtraError
        If matplotlib is not installed.
    ArgumentError
        If it is no map, or `maps` are not by robot id.
    """
    check_kind("some_map", some_map, RobotMap, JointMap)
    if maps is not None:
        check_kind("maps", maps, Mapping)
    if isinstance(some_map, RobotMap):
        draw_map(some_map, path, title)
    else:
        draw_joint(some_map, path, maps, title)


def draw_map(robot_map: RobotMap, path: str | Path, title: str | None = None) -> None:
    """Draw a robot's map: walls by support, free space beneath, the path with its start.

    Parameters
    ----------
    robot_map
        The map; components whose relative pose is unknown are drawn side by side.
    path
        The file to write, ``.svg`` or ``.png``; whole or not at all.
    title
        Its headline; names the robot by default.

    Raises
    ------
    FileError
        If `path` has another suffix or cannot be written.
    MissingExtraError
        If matplotlib is not installed.
    """
    scenes = robot_scenes(robot_map)
    scans = sum(len(submap.trajectory.scan_index) for submap in robot_map.submaps)
    facts = [_count(scans, "scan"), *_facts(scenes)]
    _draw(scenes, Path(path), title or f"Map of robot {robot_map.robot}", facts)


def draw_joint(
    joint: JointMap,
    path: str | Path,
    maps: Mapping[str, RobotMap] | None = None,
    title: str | None = None,
) -> None:
    """Draw a joint map: a colour a robot, a panel a component.

    Parameters
    ----------
    joint
        The joint map.
    path
        The file to write, ``.svg`` or ``.png``; whole or not at all.
    maps
        Robot id to robot map: they add the paths and tint the free space each robot saw; without
        them a robot is where its component starts.
    title
        Its headline; names the version by default.

    Raises
    ------
    FileError
        If `path` has another suffix or cannot be written.
    MissingExtraError
        If matplotlib is not installed.
    """
    scenes = joint_scenes(joint, maps)
    robots = {robot_of(name) for scene in scenes for name in scene.robots}
    facts = [_count(len(robots), "robot"), *_facts(scenes)]
    if len(scenes) == 1:
        facts += tell_confidence(scenes[0])
    _draw(scenes, Path(path), title or f"Joint map, version {joint.version}", facts)


def check_picture(path: Path) -> None:
    """Find out before long work, not after it, whether a picture can be drawn.

    Raises
    ------
    FileError
        If `path` ends neither in ``.svg`` nor in ``.png``.
    MissingExtraError
        If matplotlib is not installed.
    """
    _check_suffix(path)
    if find_spec("matplotlib") is None:  # loading it takes long
        raise MissingExtraError("a picture", "plot")


def _check_suffix(path: Path) -> None:
    if path.suffix.lower() not in PICTURE_SUFFIXES:
        raise FileError(
            path, f"expected a picture's name to end in {' or '.join(PICTURE_SUFFIXES)}"
        )


def _facts(scenes: Sequence[Scene]) -> list[str]:
    walls = sum(len(scene.map.segments) for scene in scenes)
    facts = [_count(walls, "wall segment")]
    if len(scenes) > 1:
        facts.append(f"{len(scenes)} components, their places to each other unknown")
    return facts


def _count(number: int, thing: str) -> str:
    return f"{number:,} {thing}{'' if number == 1 else 's'}"


def _draw(scenes: Sequence[Scene], path: Path, title: str, facts: Sequence[str]) -> None:
    _check_suffix(path)
    figure = _figure_module()
    drawn = figure.draw(scenes, title, " · ".join(facts))
    with replace_file(path) as temporary:
        figure.save(drawn, temporary, path.suffix.lower()[1:])


def _figure_module() -> ModuleType:
    """Return `mapweave.pictures.figure`, which needs matplotlib."""
    try:
        from mapweave.pictures import figure
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] != "matplotlib":
            raise
        raise MissingExtraError("a picture", "plot") from error
    return figure
