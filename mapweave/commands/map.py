"""``mapweave map``: a laser log to a robot's map."""

import argparse
import sys
from pathlib import Path

from mapweave.atomic import check_outputs
from mapweave.cli import (
    Command,
    add_config_argument,
    add_topic_argument,
    argument,
    config_of,
)
from mapweave.commands.progress import track
from mapweave.config import Config
from mapweave.errors import FileError
from mapweave.ids import check_id
from mapweave.io.map_files import save
from mapweave.io.readers.options import ReadOptions
from mapweave.io.scan_range import ScanRange
from mapweave.io.sources import STANDARD_INPUT, ScanSource, open_source
from mapweave.mapping.mapper import Mapper
from mapweave.maps import RobotMap
from mapweave.pictures.picture import check_picture_suffix, plot


def _configure(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "log",
        metavar="LOG",
        help="CARMEN, TORO or g2o, may be gzipped; a ROS bag, a file or a folder; or - for lines of"
        " JSON on standard input",
    )
    add_topic_argument(parser)
    parser.add_argument("--output", metavar="MAP.json", type=Path, help="the map file to write")
    parser.add_argument("--robot", metavar="ID", default="r1", help="the robot's id (%(default)s)")
    parser.add_argument(
        "--scans",
        metavar="A:B",
        type=argument(ScanRange.parse),
        default=ScanRange(),
        help="only scans A to B - 1",
    )
    parser.add_argument(
        "--odometry",
        choices=["none", "prior"],
        default="none",
        help="let the log's odometry help; what was seen decides (%(default)s)",
    )
    parser.add_argument(
        "--plot", metavar="MAP.png", type=Path, help="the picture to write (png, svg)"
    )
    add_config_argument(parser)


def _run(options: argparse.Namespace) -> int:
    check_id("robot", options.robot)
    config = config_of(options)
    if options.plot:
        check_picture_suffix(options.plot)
    inputs = [] if options.log == STANDARD_INPUT else [Path(options.log)]
    check_outputs([options.output, options.plot], inputs)
    step, prior = config.sensor.angular_step, options.odometry == "prior"
    source = open_source(options.log, ReadOptions(prior, step, options.topic, _warn))
    robot_map, taken = _map_all(options, source, config)
    if options.output:
        save(robot_map, options.output)
    if options.plot:
        plot(robot_map, options.plot)
    print(_summary(robot_map, taken))  # noqa: T201
    return 0


def _map_all(
    options: argparse.Namespace, source: ScanSource, config: Config
) -> tuple[RobotMap, int]:
    """Map the chosen scans; return the map and how many scans there were."""
    mapper = Mapper(options.robot, config=config, on_warning=_warn)
    scans = source.count() if sys.stderr.isatty() else None
    total = None if scans is None else options.scans.count(scans)
    name = Path(options.log).name
    taken = 0
    for scan in track(options.scans.of(source.scans()), f"mapping {name}", total):
        mapper.add(scan)
        taken += 1
    robot_map = mapper.finish()
    if not robot_map.submaps:
        raise FileError(
            options.log,
            f"none of its {taken} chosen scans can be mapped; expected scans whose"
            " returns are dense enough to show walls, and a range of scans that it has",
        )
    return robot_map, taken


def _warn(message: str) -> None:
    print(f"mapweave: {message}", file=sys.stderr)  # noqa: T201


def _summary(robot_map: RobotMap, taken: int) -> str:
    sizes = dict.fromkeys(robot_map.components, 0)
    for submap in robot_map.submaps:
        sizes[submap.component] += len(submap.trajectory.scan_index)
    segments = sum(len(submap.map.segments) for submap in robot_map.submaps)
    path = sum(submap.trajectory.length for submap in robot_map.submaps)
    return (
        f"{sum(sizes.values())} of {taken} scans placed, {max(sizes.values())} in the largest of"
        f" {len(sizes)} components; {path:.0f} m of path, {len(robot_map.submaps)} submaps,"
        f" {segments} segments"
    )


command = Command("Map a laser log without odometry.", _configure, _run)
