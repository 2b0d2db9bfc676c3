"""``mapweave bridge``: a team's joint map and poses, on a ROS 2 network."""

import argparse
import logging
import sys
import threading
from collections.abc import Callable, Iterator

from mapweave.cli import Command
from mapweave.maps import JointMap
from mapweave_protocol.link.arguments import add_connection_arguments, connection_of
from mapweave_protocol.link.stopping import stop_on_signal
from mapweave_protocol.link.subscriber import joint_maps, poses
from mapweave_protocol.wire.messages import PoseMessage
from mapweave_ros.network import Ros2Network
from mapweave_ros.output import Ros2Output

POLL = 0.1  # [s] after which a signal is noticed
FAREWELL = 2.0  # [s] for a session to be closed


def _configure(parser: argparse.ArgumentParser) -> None:
    add_connection_arguments(parser)
    parser.add_argument(
        "--to",
        default="ros2:",
        metavar="NETWORK",
        help="where ROS 2 is, such as 'ros2:?connect=tcp/127.0.0.1:7447&domain=0' (default ros2:,"
        " the team's network, $ROS_DOMAIN_ID or 0); distro=humble for that release",
    )


def _run(options: argparse.Namespace) -> int:
    logging.basicConfig(
        stream=sys.stderr, level=logging.INFO, format="%(asctime)s %(message)s", datefmt="%H:%M:%S"
    )
    team, endpoints = connection_of(options)
    network = Ros2Network.parse(options.to, endpoints)
    stopping = stop_on_signal()
    failures: list[BaseException] = []
    with Ros2Output.of_team(network, team) as output:

        def tell(news: Iterator[JointMap] | Iterator[PoseMessage]) -> None:
            try:
                for one in news:
                    output.tell(one)
            except BaseException as error:  # noqa: BLE001 - raised again where it is seen
                failures.append(error)

        def over() -> bool:
            return bool(failures) or ended.is_set()

        ended = threading.Event()
        threads = _started(
            lambda: tell(joint_maps(team, connect=endpoints, stopping=over)),
            lambda: tell(poses(team, connect=endpoints, stopping=over)),
        )
        while not (stopping() or failures):
            ended.wait(POLL)
        ended.set()
        for thread in threads:
            thread.join(FAREWELL)
    if failures:
        raise failures[0]
    return 0


def _started(*tasks: Callable[[], None]) -> list[threading.Thread]:
    """Return threads that do `tasks`; they end with the process where a router never answers."""
    threads = [threading.Thread(target=task, daemon=True) for task in tasks]
    for thread in threads:
        thread.start()
    return threads


command = Command("Show a team's joint map and poses on a ROS 2 network.", _configure, _run)
