"""``mapweave send``: a finished map becomes a robot's run in a team."""

import argparse
import hashlib
from dataclasses import replace
from pathlib import Path

import zenoh

from mapweave.cli import Command, add_config_argument, add_json_argument, config_of, say
from mapweave.commands.progress import track
from mapweave.errors import FileError
from mapweave.fusion.align import FusionParameters, align
from mapweave.ids import check_id, is_id
from mapweave.io.map_files import alignment_content, read_map
from mapweave.maps import Alignment, RobotMap, component_name
from mapweave.text import percent
from mapweave_agent.by_hand.delivery import Delivery
from mapweave_agent.past_runs import numbered_from
from mapweave_protocol.link.arguments import add_connection_arguments, connection_of
from mapweave_protocol.link.asking import ask_map_of_component
from mapweave_protocol.link.assembler import MapAssembler
from mapweave_protocol.link.security.membership import check_member
from mapweave_protocol.link.security.roster import Member, Role
from mapweave_protocol.link.session import open_session
from mapweave_protocol.operator.delivery import PATIENCE, runs_of
from mapweave_protocol.wire.messages import AlignmentMessage, MapVersion
from mapweave_protocol.wire.orders.runs_message import WireRun
from mapweave_protocol.wire.pairs import ordered

UNNAMED = "0"  # the boot of a map that was made of a file


def _configure(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("map", metavar="MAP.json", type=Path, help="a robot's map")
    parser.add_argument(
        "--robot", metavar="ID", help="as whose run it is delivered (default as the map says)"
    )
    add_connection_arguments(parser)
    add_json_argument(parser)
    add_config_argument(parser)


def _run(options: argparse.Namespace) -> int:
    robot_map = read_map(options.map)
    if not robot_map.submaps:
        raise FileError(options.map, "nothing is mapped in it; expected a submap or more")
    robot = check_id("robot", options.robot or robot_map.robot)
    boot = _boot(options.map, robot_map)
    team, endpoints, link = connection_of(options)
    if link.keys is not None and link.keys.member.role is not Role.OPERATOR:
        check_member(link, Member(team, Role.ROBOT, robot))
    parameters = FusionParameters.of(config_of(options))
    with open_session(endpoints, patience=PATIENCE, link=link) as session:
        runs = runs_of(session, team)
        own = numbered(replace(robot_map, robot=robot, boot=boot), runs)
        with Delivery(session, team, own) as delivery:
            delivery.map()
            names = [component_name(own.robot, component) for component in own.components]
            content = {"delivered": names, "boot": boot}
            say(options, content, [f"delivered: {', '.join(names)}, run {boot}"])
            others = [run for run in runs if (run.robot, run.boot) != (robot, boot)]
            for run in track(others, "comparing", len(others)):
                message = _compared(session, team, own, run, parameters)
                if message is not None:
                    delivery.alignments(message)
                    _tell(options, message.unpack())
    return 0


def numbered(own: RobotMap, runs: list[WireRun]) -> RobotMap:
    """Return a map with its components numbered above those of the robot's other runs.

    One that was delivered before keeps the numbers that it has.
    """
    of_robot = [run for run in runs if run.robot == own.robot]
    held = next((run for run in of_robot if run.boot == own.boot), None)
    if held is not None:
        return numbered_from(own, held.last - max(own.components))
    first = max((run.last + 1 for run in of_robot), default=0)
    return numbered_from(own, max(first - min(own.components), 0))


def _boot(path: Path, robot_map: RobotMap) -> str:
    """Return the name of the run: of a map made of a file, what tells its content apart."""
    if robot_map.boot != UNNAMED and is_id(robot_map.boot):
        return robot_map.boot
    return hashlib.sha256(path.read_bytes()).hexdigest()[:12]


def _compared(
    session: zenoh.Session, team: str, own: RobotMap, run: WireRun, parameters: FusionParameters
) -> AlignmentMessage | None:
    """Return how the map lies to that of another run; None where that is not there any more."""
    message = ask_map_of_component(session, team, component_name(run.robot, run.last))
    other = None if message is None else MapAssembler().update(message)
    if other is None:
        return None
    first, _ = ordered(own.robot, other.robot)
    pair = (own, other) if own.robot == first else (other, own)
    found = align(*pair, parameters)
    return AlignmentMessage.pack(own.robot, MapVersion.of(pair[0]), MapVersion.of(pair[1]), found)


def _tell(options: argparse.Namespace, found: tuple[Alignment, ...]) -> None:
    for a in found:
        sure = percent(a.confidence)
        sentence = f"{a.reference} - {a.other}: {a.decision} ({sure}): {a.reason}"
        say(options, alignment_content(a), [sentence])


command = Command(
    "Deliver a finished map to a team, as a robot's run.", _configure, _run, "r1.json --team rescue"
)
