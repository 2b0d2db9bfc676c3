"""The arguments of ``mapweave team``."""

import argparse
import re
import socket
from pathlib import Path

from mapweave.cli import add_config_argument, add_json_argument, argument, positive
from mapweave.errors import ArgumentError
from mapweave_agent.source import parse_rate
from mapweave_deploy.sim.lidars import LIDARS
from mapweave_deploy.sim.settings import SETTINGS
from mapweave_fusion_server.web.address import loopback_address
from mapweave_protocol.link.arguments import DEFAULT_TEAM
from mapweave_protocol.link.session import MAX_PORT

DEFAULT_ROBOTS = 3
MOST_ROBOTS = 64  # each is an agent on this machine, with processes of its own that compute


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the arguments."""
    parser.set_defaults(wrong_usage=parser.error)
    _add_source(parser)
    _add_run(parser)
    _add_output(parser)


def check_source(options: argparse.Namespace) -> None:
    """End with a message on usage unless there is exactly one kind of source."""
    if bool(options.logs) == (options.world is not None):
        options.wrong_usage("expected either logs or --world")
    if options.lidar and options.world is None:
        options.wrong_usage("--lidar is of simulated robots: expected --world")
    count = options.robots * max(1, len(options.logs))
    if count > MOST_ROBOTS:
        options.wrong_usage(f"--robots: {count} robots in all, expected {MOST_ROBOTS} at most")


def check_ports(options: argparse.Namespace) -> None:
    """Find out now, not by processes that end, whether router and page can listen.

    Raises
    ------
    ArgumentError
        If they cannot.
    """
    if options.listen is not None:
        host, _, port = options.listen.partition("/")[2].rpartition(":")
        _check_port("--listen", host, int(port))
    if options.http is not None:
        _check_port("--http", options.http.host, options.http.port)


def _check_port(option: str, host: str, port: int) -> None:
    name = host.strip("[]")
    family = socket.AF_INET6 if ":" in name else socket.AF_INET
    try:
        with socket.socket(family) as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)  # as who listens does
            probe.bind((name, port))
    except OSError as error:
        raise ArgumentError(option, f"{host}:{port}: {error.strerror}") from error


def _add_source(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "logs",
        nargs="*",
        type=Path,
        metavar="LOG",
        help="recorded scans, cut into overlapping stretches, one a robot; several logs may be of"
        " one building or of several",
    )
    parser.add_argument(
        "--world",
        choices=sorted(SETTINGS),
        help="a simulated place instead of logs: "
        + "; ".join(f"{name}, {setting.about}" for name, setting in sorted(SETTINGS.items())),
    )
    parser.add_argument(
        "--lidar",
        choices=sorted(LIDARS),
        help="of simulated robots: its field of view, range, rate and noise, and which way round it"
        " turns; mirrored hangs upside down, and nobody says so (default: that of the world)",
    )
    parser.add_argument(
        "--seed",
        type=argument(_natural),
        default=1,
        metavar="S",
        help="another seed furnishes the world otherwise (default 1)",
    )
    parser.add_argument(
        "--robots",
        type=argument(_positive),
        default=DEFAULT_ROBOTS,
        metavar="N",
        help=f"how many; of several logs, for each (default {DEFAULT_ROBOTS})",
    )


def _add_run(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--rate",
        type=argument(_rate),
        default="max",
        metavar="X",
        help="play the scans at X times real time, or max (the default)",
    )
    parser.add_argument(
        "--team", default=DEFAULT_TEAM, metavar="T", help=f"the team's id (default {DEFAULT_TEAM})"
    )
    parser.add_argument(
        "--listen",
        type=argument(_endpoint),
        metavar="ENDPOINT",
        help="where the router listens, such as tcp/127.0.0.1:7447 (default: a free port)",
    )
    parser.add_argument(
        "--tls",
        type=Path,
        metavar="DIR",
        help="run under keys: the whole folder that mapweave keys made, with those of robots r1 on",
    )
    parser.add_argument(
        "--http",
        type=argument(loopback_address),
        metavar="HOST:PORT",
        help="serve the live page there, on this machine only; port 0 takes a free one; at a"
        " terminal it stays until Ctrl-C",
    )
    parser.add_argument(
        "--timeout",
        type=argument(positive),
        metavar="S",
        help="give up after S seconds (default: never)",
    )
    add_config_argument(parser)
    parser.add_argument(
        "--stay",
        action="store_true",
        help="keep router and coordinator for watchers when all is done, until Ctrl-C",
    )


def _add_output(parser: argparse.ArgumentParser) -> None:
    add_json_argument(parser)
    parser.add_argument(
        "--output",
        type=Path,
        default=Path("team"),
        metavar="DIR",
        help="folder for the joint map, its picture, the store and the logs (default team)",
    )
    parser.add_argument(
        "--store",
        type=Path,
        metavar="FILE",
        help="go on with this store of the coordinator's (default: a new one in DIR)",
    )


def _natural(text: str) -> int:
    return _whole(text, 0)


def _positive(text: str) -> int:
    return _whole(text, 1)


def _whole(text: str, least: int) -> int:
    """Return the number that `text` is; ValueError unless it is whole, and `least` or more."""
    if not (text.isascii() and text.isdigit() and len(text) <= 9 and int(text) >= least):
        raise ValueError(f"{text!r}: expected a whole number, {least} or more")
    return int(text)


def _rate(text: str) -> str:
    parse_rate(text)
    return text


def _endpoint(text: str) -> str:
    """Return `text` if it is an endpoint that every process of the team can reach."""
    match = re.fullmatch(r"(?:tcp|tls)/[^\s/#?]+:([0-9]{1,5})", text)
    if match is None or not 1 <= int(match[1]) <= MAX_PORT:
        raise ValueError(
            f"{text}: expected tcp/HOST:PORT or tls/HOST:PORT, the port from 1 to {MAX_PORT}"
        )
    return text
