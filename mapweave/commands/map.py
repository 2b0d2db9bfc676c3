"""``mapweave map``: a laser log to a robot's map."""

import argparse
import sys
from collections.abc import Mapping
from contextlib import nullcontext
from dataclasses import dataclass, replace
from pathlib import Path

from mapweave.atomic import check_outputs
from mapweave.cli import (
    Command,
    add_config_argument,
    add_json_argument,
    add_topic_argument,
    argument,
    config_of,
    say,
)
from mapweave.commands.ending import Ending, ended_in_order
from mapweave.commands.garbage import spared
from mapweave.commands.progress import busy, track
from mapweave.commands.starting import Start, add_start_arguments
from mapweave.config import Config
from mapweave.errors import FileError, MapweaveError
from mapweave.ids import check_id
from mapweave.io.grids.map_server import check_no_picture, is_grid, read_grid
from mapweave.io.map_files import save
from mapweave.io.readers.options import OdometryChoice, ReadOptions
from mapweave.io.scan_range import ScanRange
from mapweave.io.sources import STANDARD_INPUT, ScanSource, open_source
from mapweave.mapping.grids.grid_map import map_of_grid
from mapweave.mapping.localization.localizer import Localizer
from mapweave.mapping.mapper import Mapper
from mapweave.mapping.scan_mapper import ScanMapper
from mapweave.maps import RobotMap
from mapweave.pictures.picture import check_picture, plot
from mapweave.scan.scan import MIN_BEAMS
from mapweave.text import counted

ROBOT = "r1"


@dataclass(frozen=True, slots=True, eq=False)
class _Mapped:
    """What came of `scans`; with what ended them, where that is no end."""

    map: RobotMap
    scans: int
    beams: int  # of that scan which has the most
    failure: MapweaveError | None


def _configure(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "log",
        metavar="LOG",
        help="CARMEN, TORO or g2o, may be gzipped; a ROS bag, a file or a folder; the .yaml of a"
        " map_server grid; or - for lines of JSON on standard input",
    )
    add_topic_argument(parser)
    parser.add_argument("--output", metavar="MAP.json", type=Path, help="the map file to write")
    parser.add_argument(
        "--robot", metavar="ID", help=f"the robot's id ({ROBOT}, or that of the map to continue)"
    )
    parser.add_argument(
        "--scans",
        metavar="A:B",
        type=argument(ScanRange.parse),
        default=ScanRange(),
        help="only scans A to B - 1",
    )
    parser.add_argument(
        "--odometry",
        type=argument(OdometryChoice.parse),
        default="none",
        metavar="WHICH",
        help="let odometry help; what was seen decides: none, prior for that of the log, or a"
        " bag's topic, such as /odom or /tf (default %(default)s)",
    )
    add_start_arguments(parser)
    parser.add_argument(
        "--plot", metavar="MAP.png", type=Path, help="the picture to write (png, svg)"
    )
    add_json_argument(parser)
    add_config_argument(parser)


def _run(options: argparse.Namespace) -> int:
    if options.robot is not None:
        check_id("robot", options.robot)
    config = config_of(options)
    if options.plot:
        check_picture(options.plot)
    inputs = [] if options.log == STANDARD_INPUT else [Path(options.log)]
    stored = [path for path in (options.continued, options.localize) if path is not None]
    check_outputs([options.output, options.plot], [*inputs, *stored])
    start = Start.of(options)
    check_no_picture(Path(options.log))
    if is_grid(Path(options.log)):
        return _run_grid(options, config)
    source = open_source(options.log, _read_options(options, config))
    mapper = _mapper(options.robot, start, config)
    # A recording is there to be mapped again: Ctrl-C gives it up.
    with ended_in_order() if source.live else nullcontext() as ending:
        mapped = _map_all(options, source, mapper, ending)
        _check_placed(options, source, mapped, start)
        _write(options, mapped.map)
    figures = _figures(_new(mapped.map, start), mapped.scans)
    _tell(options, figures, _sentence(figures))
    if mapped.failure is not None:
        raise mapped.failure
    return 0


def _read_options(options: argparse.Namespace, config: Config) -> ReadOptions:
    odometry: OdometryChoice = options.odometry
    if odometry.live:
        raise FileError(options.log, f"has no live odometry; expected {odometry.topic} of a bag")
    step = config.sensor.angular_step
    return ReadOptions(odometry.prior, step, options.topic, _warn, odometry_topic=odometry.topic)


def _run_grid(options: argparse.Namespace, config: Config) -> int:
    """Turn another program's grid into a map."""
    for given, name in ((options.continued, "--continue"), (options.localize, "--localize")):
        if given is not None:
            raise FileError(options.log, f"is a grid; expected a log to take {name} with")
    with busy(f"reading {Path(options.log).name}"):
        robot_map = map_of_grid(read_grid(Path(options.log)), options.robot or ROBOT, config)
    if not robot_map.submaps:
        raise FileError(options.log, "no wall of it can be seen from its free cells; expected some")
    _write(options, robot_map)
    lines = robot_map.submaps[0].map
    figures = {"polylines": len(lines.polylines), "segments": len(lines.segments)}
    _tell(options, figures, "{polylines} polylines, {segments} segments".format(**figures))
    return 0


def _tell(options: argparse.Namespace, figures: Mapping[str, float], sentence: str) -> None:
    say(options, dict(figures), [sentence])
    if not (options.output or options.plot or options.json):
        print("The map is not kept: --output MAP.json keeps it.")  # noqa: T201


def _write(options: argparse.Namespace, robot_map: RobotMap) -> None:
    if options.output:
        save(robot_map, options.output)
    if options.plot:
        plot(robot_map, options.plot)


def _mapper(robot: str | None, start: Start, config: Config) -> ScanMapper:
    """Return what maps, or localizes, as `start` says."""
    if start.place is not None:
        return Localizer(
            start.place, robot or ROBOT, config=config, on_warning=_warn, on_news=_warn
        )
    name = ROBOT if start.known is None else start.known.robot
    return Mapper(robot or name, config=config, on_warning=_warn, known=start.known)


def _map_all(
    options: argparse.Namespace, source: ScanSource, mapper: ScanMapper, ending: Ending | None
) -> _Mapped:
    """Map the chosen scans, as far as they can be read."""
    taken = beams = 0
    failure: MapweaveError | None = None
    chosen = options.scans.of(source.scans())
    if ending is not None:
        chosen = ending.until(chosen)
    with spared():
        try:
            for scan in track(chosen, f"mapping {Path(options.log).name}", _total(options, source)):
                mapper.add(scan)
                taken, beams = taken + 1, max(beams, len(scan.ranges))
        except MapweaveError as error:
            failure = error
        if ending is not None and ending.asked:
            _warn(_what_is_kept(options))
        return _Mapped(mapper.finish(), taken, beams, failure)


def _total(options: argparse.Namespace, source: ScanSource) -> int | None:
    """Return how many scans there will be, where a person waits for them."""
    try:
        scans = source.count() if sys.stderr.isatty() else None
    except MapweaveError:  # told where it cannot be read any further
        return None
    return None if scans is None else int(options.scans.count(scans))


def _what_is_kept(options: argparse.Namespace) -> str:
    kept = [str(path) for path in (options.output, options.plot) if path is not None]
    return "ended: what came until now is mapped" + (f", for {' and '.join(kept)}" if kept else "")


def _new(robot_map: RobotMap, start: Start) -> RobotMap:
    """Return what this run has mapped, or where it was located."""
    return replace(robot_map, submaps=robot_map.submaps[start.submaps :])


def _check_placed(
    options: argparse.Namespace, source: ScanSource, mapped: _Mapped, start: Start
) -> None:
    if mapped.scans and _new(mapped.map, start).submaps:
        return
    if mapped.failure is not None:
        raise mapped.failure
    if not mapped.scans:
        raise FileError(_name(options), _nothing_chosen(source, options.scans))
    if options.localize is not None:
        raise FileError(
            _name(options),
            f"none of its {mapped.scans} chosen scans can be found in {options.localize}; expected"
            " some metres of a drive in a place that it shows",
        )
    wanted = "scans whose returns are dense enough to show walls"
    if mapped.beams < MIN_BEAMS:
        wanted = f"{MIN_BEAMS} beams or more, got {mapped.beams}"
    raise FileError(
        _name(options), f"none of its {mapped.scans} chosen scans can be mapped; expected {wanted}"
    )


def _name(options: argparse.Namespace) -> str:
    return "standard input" if options.log == STANDARD_INPUT else str(options.log)


def _nothing_chosen(source: ScanSource, chosen: ScanRange) -> str:
    count = source.count()
    if count is None:
        return f"ended before scan {chosen.first} came"
    return f"has {counted(count, 'scan')}, none of them in {chosen}"


def _warn(message: str) -> None:
    print(f"mapweave: {message}", file=sys.stderr)  # noqa: T201


def _figures(robot_map: RobotMap, taken: int) -> dict[str, float]:
    """Return what there is to say of a map, by name."""
    sizes = dict.fromkeys(robot_map.components, 0)
    for submap in robot_map.submaps:
        sizes[submap.component] += len(submap.trajectory.scan_index)
    return {
        "scans": taken,
        "placed": sum(sizes.values()),
        "largest": max(sizes.values()),
        "components": len(sizes),
        "path_m": round(sum(submap.trajectory.length for submap in robot_map.submaps), 1),
        "submaps": len(robot_map.submaps),
        "segments": sum(len(submap.map.segments) for submap in robot_map.submaps),
    }


def _sentence(figures: dict[str, float]) -> str:
    parts = counted(int(figures["components"]), "component")
    lines = counted(int(figures["segments"]), "segment")
    return (
        "{placed} of {scans} scans placed, {largest} in the largest of {parts}; {path_m:.0f} m of"
        " path, {pieces}, {lines}"
    ).format(**figures, parts=parts, pieces=counted(int(figures["submaps"]), "submap"), lines=lines)


command = Command(
    "Map a laser log without odometry.",
    _configure,
    _run,
    "robot.log --output r1.json --plot r1.png",
)
