"""``mapweave agent``: the process of one robot."""

import argparse
import logging
import sys
import time
from functools import partial
from pathlib import Path

import zenoh

from mapweave.cli import Command, add_config_argument, argument, config_of, positive
from mapweave.fusion.align import FusionParameters, align
from mapweave.ids import check_id
from mapweave.io.scan_range import ScanRange
from mapweave.mapping.mapper import Mapper, MapperParameters
from mapweave.maps import RobotMap
from mapweave_agent.agent import Agent
from mapweave_agent.backend_process import BackendProcess
from mapweave_agent.comparison_worker import ComparisonWorker
from mapweave_agent.past_runs import StateFolder, default_folder, first_component, young_enough
from mapweave_agent.publication_schedule import AgentParameters
from mapweave_agent.source import LogSource, ReplayClock, parse_rate
from mapweave_protocol.errors import MessageError
from mapweave_protocol.link.arguments import add_connection_arguments, connection_of
from mapweave_protocol.link.asking import ask_robot_map
from mapweave_protocol.link.assembler import MapAssembler
from mapweave_protocol.link.session import open_session
from mapweave_protocol.link.stopping import stop_on_signal
from mapweave_protocol.wire.keys import new_boot

RESUME_WITHIN = 3600.0  # [s]

_log = logging.getLogger(__name__)


def _configure(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--robot", required=True, metavar="ID", help="the robot's id")
    parser.add_argument("--log", required=True, type=Path, help="the laser log to play")
    parser.add_argument(
        "--rate",
        type=argument(parse_rate),
        default="1",
        metavar="X",
        help="how many times real time the log is played, or max (default 1)",
    )
    parser.add_argument(
        "--scans",
        type=argument(ScanRange.parse),
        default=":",
        metavar="A:B",
        help="which scans, counted from 0, B not included",
    )
    parser.add_argument(
        "--map-interval",
        type=argument(positive),
        default=AgentParameters().map_interval,
        metavar="S",
        help="least time between two messages of the growing submap [s] (default %(default)g)",
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
    clock = ReplayClock(options.rate)
    # Everything that can be wrong with the input is found before anybody hears of the robot.
    source = LogSource.open(options.log, options.scans, _log.warning, config.sensor.angular_step)
    state = StateFolder(options.state or default_folder(team, robot))
    runs = state.runs(robot, time.time())

    def tell_waiting() -> None:
        _log.info("waiting for a router at %s", ", ".join(endpoints))

    mapping = MapperParameters.of(config)
    compare = partial(align, parameters=FusionParameters.of(config))
    with (
        ComparisonWorker(compare) as comparer,
        BackendProcess(mapping.backend) as backend,
        open_session(endpoints, on_wait=tell_waiting) as session,
    ):
        mapper = Mapper(robot, new_boot(), mapping, backend, config)
        parameters = AgentParameters(map_interval=options.map_interval)
        past = young_enough(runs, options.resume_within)
        first = first_component([*(run.map for run in runs), *_held(session, team, robot)])
        agent = Agent(session, team, mapper, comparer, source.total, parameters, state, past, first)
        agent.run(source.scans(), clock, stop_on_signal())
    return 0


def _held(session: zenoh.Session, team: str, robot: str) -> list[RobotMap]:
    """Return the map of the robot's last run that the coordinator holds, if there is one."""
    try:
        message = ask_robot_map(session, team, robot)
    except MessageError as error:
        _log.warning("answer ignored, %s", error)
        return []
    held = MapAssembler().update(message) if message is not None else None
    return [] if held is None else [held]


command = Command("Map the scans of one robot, and compare with its team.", _configure, _run)
