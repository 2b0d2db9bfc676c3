"""``mapweave agent``: the process of one robot."""

import argparse
import logging
import math
import sys
from functools import partial
from pathlib import Path

from mapweave.cli import (
    Command,
    add_config_argument,
    add_topic_argument,
    argument,
    config_of,
    positive,
)
from mapweave.commands.starting import Start, add_start_arguments
from mapweave.fusion.align import FusionParameters, align
from mapweave.garbage import spared
from mapweave.ids import check_id
from mapweave.io.readers.options import ReadOptions
from mapweave.io.scan_range import ScanRange
from mapweave.io.sources import ScanSource, open_source
from mapweave_agent.agent import AgentRun
from mapweave_agent.comparison_worker import ComparisonWorker
from mapweave_agent.live.ros2_output import output_of
from mapweave_agent.live.scans import scans_of
from mapweave_agent.publication_schedule import AgentParameters
from mapweave_agent.source import ReplayClock, count_selected, parse_rate, told_once
from mapweave_agent.stored.mappers import mapper_of
from mapweave_agent.taking_up import RESUME_WITHIN, EarlierRuns
from mapweave_protocol.link.arguments import add_connection_arguments, connection_of
from mapweave_protocol.link.session import open_session
from mapweave_protocol.link.stopping import stop_on_signal
from mapweave_protocol.wire.keys import new_boot

_log = logging.getLogger(__name__)


def _configure(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--robot", required=True, metavar="ID", help="the robot's id")
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
    add_start_arguments(parser)
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
    add_connection_arguments(parser)
    add_config_argument(parser)


def _run(options: argparse.Namespace) -> int:
    logging.basicConfig(
        stream=sys.stderr, level=logging.INFO, format="%(asctime)s %(message)s", datefmt="%H:%M:%S"
    )
    robot = check_id("robot", options.robot)
    team, endpoints = connection_of(options)
    config = config_of(options)
    # Everything that can be wrong with the input is found before anybody hears of the robot.
    step, warn = config.sensor.angular_step, told_once(_log.warning)
    source = open_source(options.source, ReadOptions(False, step, options.topic, warn, endpoints))
    start = Start.of(options)
    total = count_selected(options.source, source, options.scans)
    output = output_of(options.publish, robot, endpoints, source)
    earlier = EarlierRuns.of(team, robot, options.state)

    def tell_waiting() -> None:
        _log.info("waiting for a router at %s", ", ".join(endpoints))

    compare = partial(align, parameters=FusionParameters.of(config))
    live = source.live and not math.isinf(options.rate)
    with (
        output as tell,
        ComparisonWorker(compare) as comparer,
        mapper_of(start, robot, new_boot(), config, live=live) as mapper,
        open_session(endpoints, on_wait=tell_waiting) as session,
    ):
        parameters = AgentParameters(map_interval=options.map_interval)
        past = earlier.young(options.resume_within)
        first = earlier.first_component(session, team, robot)
        run = AgentRun(
            session, team, mapper, comparer, total, parameters, earlier.folder, past, first, tell
        )
        with spared():
            _run_on(source, run, options)
    return 0


def _run_on(source: ScanSource, run: AgentRun, options: argparse.Namespace) -> None:
    """Run on the scans chosen: a recording is played at a rate, others come when they come."""
    stopping = stop_on_signal()
    if source.live:
        skipping = not math.isinf(options.rate)
        with scans_of(source, options.scans, skipping=skipping) as scans:
            run.run_live(scans, stopping)
    else:
        run.run(options.scans.of(source.scans()), ReplayClock(options.rate), stopping)


command = Command("Map the scans of one robot, and compare with its team.", _configure, _run)
