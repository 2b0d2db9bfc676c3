"""``mapweave bridge``: a team's joint map and poses, on a ROS 2 network."""

import argparse
import logging
import sys
import threading
from collections.abc import Callable, Iterator, Sequence

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
    with Ros2Output.of_team(network, team) as output:
        _Following(team, endpoints, output).run(stopping)
    return 0


class _Following:
    """Leaves what a team says at an output, each kind from a thread of its own."""

    def __init__(self, team: str, endpoints: Sequence[str], output: Ros2Output) -> None:
        self._team = team
        self._endpoints = endpoints
        self._output = output
        self._over = threading.Event()
        self._failure: BaseException | None = None

    def run(self, stopping: Callable[[], bool]) -> None:
        """Follow until `stopping`, or one of them fails.

        Raises
        ------
        MapweaveError
            If one has failed.
        """
        # They end with the process where a router never answers.
        threads = [
            threading.Thread(target=self._follow, args=(subscribe,), daemon=True)
            for subscribe in (joint_maps, poses)
        ]
        for thread in threads:
            thread.start()
        while not (stopping() or self._over.wait(POLL)):
            pass
        self._over.set()
        for thread in threads:
            thread.join(FAREWELL)
        if self._failure is not None:
            raise self._failure

    def _follow(self, subscribe: Callable[..., Iterator[JointMap | PoseMessage]]) -> None:
        try:
            for news in subscribe(self._team, connect=self._endpoints, stopping=self._over.is_set):
                self._output.tell(news)
        except BaseException as error:  # noqa: BLE001 - raised again where it is seen
            self._failure = error
            self._over.set()


command = Command(
    "Show a team's joint map and poses on a ROS 2 network.",
    _configure,
    _run,
    "--team rescue --to 'ros2:?connect=tcp/localhost:7447'",
)
