"""``mapweave fuse``: robots' maps to a joint map."""

import argparse
from itertools import combinations
from pathlib import Path

from mapweave.atomic import check_outputs
from mapweave.cli import Command, add_config_argument, config_of
from mapweave.commands.progress import track
from mapweave.config import Config
from mapweave.errors import FileError
from mapweave.fusion.align import FusionParameters, align
from mapweave.io.map_files import read_map, save
from mapweave.maps import Alignment, JointMap, RobotMap, parse_component
from mapweave.pictures.picture import check_picture_suffix, plot
from mapweave.team.joint_map import fuse
from mapweave.text import percent

EXIT_NOT_ALL_JOINED = 3


def _configure(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("first", metavar="MAP.json", type=Path, help="a robot's map")
    parser.add_argument("others", metavar="MAP.json", type=Path, nargs="+", help="other robots'")
    parser.add_argument("--output", metavar="JOINT.json", type=Path, help="the joint map to write")
    parser.add_argument("--plot", metavar="JOINT.png", type=Path, help="the picture (png, svg)")
    add_config_argument(parser)


def _run(options: argparse.Namespace) -> int:
    config = config_of(options)
    if options.plot:
        check_picture_suffix(options.plot)
    inputs = [options.first, *options.others]
    check_outputs([options.output, options.plot], inputs)
    maps = _read_distinct(inputs)
    joint = fuse(list(maps.values()), _compared(list(maps.values()), config), config)
    if options.output:
        save(joint, options.output)
    if options.plot:
        plot(joint, options.plot, maps)
    for line in tell(joint):
        print(line)  # noqa: T201
    return 0 if _all_robots_joined(joint, len(maps)) else EXIT_NOT_ALL_JOINED


def _read_distinct(paths: list[Path]) -> dict[str, RobotMap]:
    """Read maps; each is of another robot."""
    maps: dict[str, RobotMap] = {}
    for path in paths:
        robot_map = read_map(path)
        if robot_map.robot in maps:
            raise FileError(
                path,
                f"robot {robot_map.robot!r} was given already; expected a map of another robot",
            )
        maps[robot_map.robot] = robot_map
    return maps


def _compared(maps: list[RobotMap], config: Config) -> list[Alignment]:
    """Compare all pairs of `maps`."""
    pairs, parameters = list(combinations(maps, 2)), FusionParameters.of(config)
    return [a for one, other in track(pairs, "comparing") for a in align(one, other, parameters)]


def tell(joint: JointMap) -> list[str]:
    """Return what was found, a line an alignment and a line a component."""
    return [*map(_tell_alignment, joint.alignments), *_tell_components(joint)]


def _tell_alignment(alignment: Alignment) -> str:
    return (
        f"{alignment.reference} - {alignment.other}: {alignment.decision}"
        f" ({percent(alignment.confidence)}): {alignment.reason}"
    )


def _tell_components(joint: JointMap) -> list[str]:
    return [
        f"component of {', '.join(c.robots)}: {len(c.map.segments)} segments,"
        f" {f'confidence {percent(c.confidence)}' if len(c.robots) > 1 else 'alone'}"
        for c in joint.components
    ]


def _all_robots_joined(joint: JointMap, robots: int) -> bool:
    """Whether one component has a part of every robot."""
    return any(
        len({parse_component(name)[0] for name in component.robots}) == robots
        for component in joint.components
    )


command = Command("Join robots' maps where what both saw proves it.", _configure, _run)
