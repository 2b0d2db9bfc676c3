"""``mapweave agent``: the process of one robot."""

import argparse
import logging
import math
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path

from mapweave.atomic import check_outputs
from mapweave.cli import (
    Command,
    add_config_argument,
    add_topic_argument,
    argument,
    config_of,
    positive,
)
from mapweave.commands.garbage import spared
from mapweave.commands.starting import Start, add_start_arguments
from mapweave.config import Config
from mapweave.errors import ArgumentError, UnusableOdometryError
from mapweave.fusion.align import FusionParameters, align
from mapweave.ids import check_id
from mapweave.io.map_files import save
from mapweave.io.readers.options import OdometryChoice, ReadOptions
from mapweave.io.scan_range import ScanRange
from mapweave.io.sources import ScanSource, open_source
from mapweave.maps import RobotMap
from mapweave_agent.agent import AgentRun
from mapweave_agent.comparison_worker import ComparisonWorker
from mapweave_agent.live.joining import Connected, connecting
from mapweave_agent.live.ros2_output import output_of
from mapweave_agent.live.scans import scans_of
from mapweave_agent.publication_schedule import AgentParameters
from mapweave_agent.source import ReplayClock, count_selected, parse_rate, told_once
from mapweave_agent.stored.mappers import mapper_of
from mapweave_agent.taking_up import RESUME_WITHIN, EarlierRuns
from mapweave_protocol.link.arguments import (
    add_connection_arguments,
    connection_of,
    tell_waiting,
)
from mapweave_protocol.link.security.membership import check_member
from mapweave_protocol.link.security.roster import Member, Role
from mapweave_protocol.link.security.settings import LinkSettings
from mapweave_protocol.link.session import open_session
from mapweave_protocol.link.stopping import StopSignals
from mapweave_protocol.narration.logs import add_log_arguments, begin_log
from mapweave_protocol.wire.keys import new_boot

_log = logging.getLogger(__name__)


def _configure(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--robot", required=True, metavar="ID", help="the robot's id")
    _add_what_is_mapped(parser)
    add_start_arguments(parser)
    _add_what_is_told(parser)
    _add_what_is_kept(parser)
    add_connection_arguments(parser)
    add_log_arguments(parser)
    add_config_argument(parser)


def _add_what_is_mapped(parser: argparse.ArgumentParser) -> None:
    sources = parser.add_mutually_exclusive_group(required=True)
    sources.add_argument(
        "--source",
        metavar="SOURCE",
        help="where the scans come from: a log or a bag to play, - for lines of JSON on standard"
        " input, ros2:/scan for a ROS 2 topic on Zenoh, or what an installed package brings",
    )
    sources.add_argument(
        "--log", dest="source", metavar="LOG", help="the laser log to play, as --source"
    )
    add_topic_argument(parser)
    parser.add_argument(
        "--rate",
        type=argument(parse_rate),
        default="1",
        metavar="X",
        help="how many times real time a recording is played, or max (default 1); with max no scan"
        " of a live source is skipped either",
    )
    parser.add_argument(
        "--scans",
        type=argument(ScanRange.parse),
        default=":",
        metavar="A:B",
        help="which scans, counted from 0, B not included",
    )
    parser.add_argument(
        "--odometry",
        type=argument(OdometryChoice.parse),
        default="none",
        metavar="WHICH",
        help="let odometry help; what was seen decides: none, prior for that of the log, a bag's"
        " topic such as /odom, or ros2:/odom or ros2:/tf where the scans are (default %(default)s)",
    )


def _add_what_is_told(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--map-interval",
        type=argument(positive),
        default=AgentParameters().map_interval,
        metavar="S",
        help="least time between two messages of the growing submap [s] (default %(default)g)",
    )
    parser.add_argument(
        "--publish",
        metavar="NETWORK",
        help="show the robot's map and pose on a ROS 2 network as well: ros2: for the team's, or"
        " such as 'ros2:?connect=tcp/127.0.0.1:7447&domain=0'",
    )


def _add_what_is_kept(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--output",
        type=Path,
        metavar="MAP.json",
        help="write the robot's map there when the agent ends, such as for --continue",
    )
    parser.add_argument(
        "--state",
        type=Path,
        metavar="DIR",
        help="where the robot's runs are kept (default $XDG_STATE_HOME/mapweave/TEAM/ROBOT)",
    )
    parser.add_argument(
        "--resume-within",
        type=argument(positive),
        default=RESUME_WITHIN,
        metavar="S",
        help="earlier runs that ended longer ago are kept, but not sent [s] (default %(default)g)",
    )


def _run(options: argparse.Namespace) -> int:
    robot = check_id("robot", options.robot)
    begin_log(options, robot)
    team, endpoints, link = connection_of(options)
    check_member(link, Member(team, Role.ROBOT, robot))
    config = config_of(options)
    stored = [path for path in (options.continued, options.localize) if path is not None]
    check_outputs([options.output], stored)
    # Everything that can be wrong with the input is found before anybody hears of the robot.
    source = open_source(options.source, _read_options(options, config, endpoints))
    start = Start.of(options)
    total = count_selected(options.source, source, options.scans)
    output = output_of(options.publish, robot, endpoints, source)
    earlier = EarlierRuns.of(team, robot, options.state)

    compare = partial(align, parameters=FusionParameters.of(config))
    live = source.live and not math.isinf(options.rate)
    with (
        output as tell,
        ComparisonWorker(compare) as comparer,
        mapper_of(start, robot, new_boot(), config, live=live) as mapper,
        _connection(source, endpoints, link) as connected,
    ):
        parameters = AgentParameters(map_interval=options.map_interval)
        past = earlier.young(options.resume_within)
        first = earlier.first_component(connected(), team, robot)
        run = AgentRun(
            connected, team, mapper, comparer, total, parameters, earlier.folder, past, first, tell
        )
        stopping = StopSignals()
        with stopping.nothing_lost(lambda: _hurry(run, earlier.folder.path, options)):
            try:
                with spared():
                    _run_on(source, run, stopping, options)
            finally:  # also where its source has failed
                _write(run.robot_map, options.output)
    return 0


def _hurry(run: AgentRun, state: Path, options: argparse.Namespace) -> None:
    """Leave at once, and say what becomes of the map."""
    run.hurry()
    written = f"the map is being written to {options.output}; " if options.output else ""
    _log.warning(
        "ends without waiting for the team: %sall of it is in %s, and an agent of the same --team,"
        " --robot and --state delivers it within %g s",
        written,
        state,
        options.resume_within,
    )


@contextmanager
def _connection(
    source: ScanSource, endpoints: tuple[str, ...], link: LinkSettings
) -> Iterator[Connected]:
    """Give a block the team's session: a recording waits for it, a robot that drives does not."""
    on_wait = partial(tell_waiting, _log)
    if source.live:
        with connecting(endpoints, on_wait, link) as connected:
            yield connected
    else:
        with open_session(endpoints, on_wait=on_wait, link=link) as session:
            yield lambda: session


def _write(robot_map: RobotMap, path: Path | None) -> None:
    if path is not None and not robot_map.submaps:
        _log.warning("%s is not written: nothing was mapped", path)
    elif path is not None:
        save(robot_map, path)
        _log.info("the map is in %s", path)


def _read_options(
    options: argparse.Namespace, config: Config, endpoints: tuple[str, ...]
) -> ReadOptions:
    odometry: OdometryChoice = options.odometry
    if odometry == OdometryChoice(prior=True) and options.source.startswith("ros2:"):
        problem = "prior is that of a recording; expected ros2:/odom or ros2:/tf, or another topic"
        raise ArgumentError("--odometry", problem)
    if odometry.live and not options.source.startswith("ros2:"):
        raise UnusableOdometryError(options.source, f"ros2:{odometry.topic}")
    return ReadOptions(
        odometry.prior,
        config.sensor.angular_step,
        options.topic,
        told_once(_log.warning),
        endpoints,
        odometry.topic,
        on_news=told_once(_log.info),
    )


def _run_on(
    source: ScanSource, run: AgentRun, stopping: StopSignals, options: argparse.Namespace
) -> None:
    """Run on the scans chosen: a recording is played at a rate, others come when they come."""
    if source.live:
        skipping = not math.isinf(options.rate)
        with scans_of(source, options.scans, skipping=skipping) as scans:
            run.run_live(scans, stopping)
    else:
        run.run(options.scans.of(source.scans()), ReplayClock(options.rate), stopping)


command = Command(
    "Map the scans of one robot, and compare with its team.",
    _configure,
    _run,
    "--robot r1 --team rescue --source ros2:/scan",
)
