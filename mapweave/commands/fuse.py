"""``mapweave fuse``: robots' maps to a joint map."""

import argparse
import sys
from collections.abc import Mapping, Sequence
from itertools import combinations, product
from pathlib import Path

from mapweave.atomic import check_outputs
from mapweave.cli import Command, add_config_argument, add_json_argument, config_of, say
from mapweave.commands.progress import busy, track
from mapweave.commands.stored_joint import as_robot_maps, robots_of, with_members
from mapweave.config import Config
from mapweave.errors import FileError
from mapweave.fusion.align import FusionParameters, align
from mapweave.io.map_files import alignment_content, load, save
from mapweave.mapping.localization.followed import joined_by, path_followed
from mapweave.maps import Alignment, JointMap, RobotMap, parse_component
from mapweave.pictures.picture import check_picture, plot
from mapweave.team.joint_map import fuse
from mapweave.text import percent

EXIT_NOT_ALL_JOINED = 3


def _configure(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "first", metavar="MAP.json", type=Path, help="a robot's map, or a stored joint map"
    )
    parser.add_argument("others", metavar="MAP.json", type=Path, nargs="+", help="other robots'")
    parser.add_argument("--output", metavar="JOINT.json", type=Path, help="the joint map to write")
    parser.add_argument("--plot", metavar="JOINT.png", type=Path, help="the picture (png, svg)")
    add_json_argument(parser)
    add_config_argument(parser)


def _run(options: argparse.Namespace) -> int:
    config = config_of(options)
    if options.plot:
        check_picture(options.plot)
    inputs = [options.first, *options.others]
    check_outputs([options.output, options.plot], inputs)
    given = _read_distinct(inputs)
    followed = _followed(given)
    paths = {path.robot: path for _, path in followed}
    maps = [paths.get(m.robot, m) for some in given for m in _as_maps(some)]
    stored = [some for some in given if isinstance(some, JointMap)]
    alignments = _compared(given, config)
    for known, path in followed:
        _warn_followed(known)
        alignments = joined_by(alignments, known, path)
    with busy("joining"):
        joint = with_members(fuse(maps, alignments, config), stored)
    if options.output:
        save(joint, options.output)
    if options.plot:
        plot(joint, options.plot, {m.robot: m for m in given if isinstance(m, RobotMap)})
    say(options, _content(joint), tell(joint))
    if not (options.output or options.plot or options.json):
        print("The joint map is not kept: --output JOINT.json keeps it.")  # noqa: T201
    robots = set().union(*(_robots(some) for some in given))
    return 0 if _all_joined(joint, robots) else EXIT_NOT_ALL_JOINED


def _read_distinct(paths: list[Path]) -> list[RobotMap | JointMap]:
    """Read maps; each is of other robots."""
    maps: list[RobotMap | JointMap] = []
    robots: set[str] = set()
    for path in paths:
        some_map = load(path)
        if twice := sorted(_robots(some_map) & robots):
            raise FileError(
                path,
                f"robot {twice[0]!r} was given already; expected a map of another robot: give each"
                " one an id of its own, as with mapweave map --robot r2",
            )
        robots |= _robots(some_map)
        _check_no_part(path, some_map, dict(zip(paths, maps, strict=False)))
        maps.append(some_map)
    return maps


def _check_no_part(
    path: Path, some_map: RobotMap | JointMap, others: Mapping[Path, RobotMap | JointMap]
) -> None:
    """Refuse what one of `others` goes on from, or that goes on from it: one drive, told twice."""
    own = _drives(some_map)
    for before, other in others.items():
        theirs = _drives(other)
        if own.isdisjoint(theirs):
            continue
        wanted = "maps of drives of their own"
        if own <= theirs or own >= theirs:
            wanted = f"only the one that has more, {path if len(own) > len(theirs) else before}"
        raise FileError(
            path,
            f"has submaps of {before} as they are, which would count twice; expected {wanted}",
        )


def _drives(some_map: RobotMap | JointMap) -> set[bytes]:
    """Return what tells a submap apart that is the same to the last digit: its walls, and when."""
    if not isinstance(some_map, RobotMap) or path_followed(some_map) is not None:
        return set()
    return {
        submap.map.segments.tobytes() + submap.trajectory.stamp.tobytes()
        for submap in some_map.submaps
        if len(submap.map.segments)
    }


def _robots(some_map: RobotMap | JointMap) -> set[str]:
    return {some_map.robot} if isinstance(some_map, RobotMap) else robots_of(some_map)


def _as_maps(some_map: RobotMap | JointMap) -> list[RobotMap]:
    return [some_map] if isinstance(some_map, RobotMap) else as_robot_maps(some_map)


def _followed(given: Sequence[RobotMap | JointMap]) -> list[tuple[RobotMap, RobotMap]]:
    """Return the maps of robots that only followed in a stored one, each with the path driven."""
    mapped = [some for some in given if isinstance(some, RobotMap)]
    return [(m, path) for m in mapped if (path := path_followed(m)) is not None]


def _warn_followed(followed: RobotMap) -> None:
    """Say that walls of others' making are not counted."""
    print(  # noqa: T201
        f"mapweave: robot {followed.robot!r} only followed in a stored map: the walls of that map"
        " are no second witness and are not counted; give that map as well to have them",
        file=sys.stderr,
    )


def _compared(given: list[RobotMap | JointMap], config: Config) -> list[Alignment]:
    """Compare all pairs of what is `given`; what is in one joint map was compared then."""
    pairs = [
        pair
        for one, other in combinations(given, 2)
        if len(_followed([one, other])) < 2  # walls of others' making, both
        for pair in product(_as_maps(one), _as_maps(other))
    ]
    parameters = FusionParameters.of(config)
    return [a for one, other in track(pairs, "comparing") for a in align(one, other, parameters)]


def _content(joint: JointMap) -> dict[str, object]:
    """Return what `tell` does, as values."""
    return {
        "alignments": [alignment_content(alignment) for alignment in joint.alignments],
        "components": [
            {
                "robots": {name: pose.tolist() for name, pose in component.robots.items()},
                "confidence": component.confidence,
                "segments": len(component.map.segments),
            }
            for component in joint.components
        ],
    }


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


def _all_joined(joint: JointMap, robots: set[str]) -> bool:
    """Whether one component has a part of every robot."""
    return any(
        {parse_component(name)[0] for name in component.robots} == robots
        for component in joint.components
    )


command = Command(
    "Join robots' maps where what both saw proves it.",
    _configure,
    _run,
    "a.json b.json --output joint.json --plot joint.png",
)
