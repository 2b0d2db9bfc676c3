"""``mapweave bridge``: a team's joint map and poses, on a ROS 2 network or in Foxglove."""

import argparse
import logging
import math
import threading
import time
from collections.abc import Callable, Iterator, Sequence

from mapweave.cli import Command
from mapweave.errors import ArgumentError
from mapweave.maps import JointMap
from mapweave_protocol.link.arguments import add_connection_arguments, connection_of
from mapweave_protocol.link.security.settings import LinkSettings
from mapweave_protocol.link.stopping import StopSignals
from mapweave_protocol.link.subscriber import joint_maps, poses
from mapweave_protocol.narration.logs import add_log_arguments, begin_log
from mapweave_protocol.wire.messages import PoseMessage
from mapweave_ros.foxglove_live import SCHEME as FOXGLOVE
from mapweave_ros.foxglove_live import FoxgloveOutput
from mapweave_ros.network import SCHEME, Ros2Network
from mapweave_ros.output import Ros2Output

POLL = 0.1  # [s] after which a signal is noticed
FAREWELL = 2.0  # [s] for a session to be closed
PATIENCE = 5.0  # [s] after which it is said what nothing is heard of

_log = logging.getLogger(__name__)


def _configure(parser: argparse.ArgumentParser) -> None:
    add_connection_arguments(parser)
    add_log_arguments(parser)
    parser.add_argument(
        "--to",
        default="ros2:",
        metavar="WHERE",
        help="where ROS 2 is, such as 'ros2:?connect=tcp/127.0.0.1:7447&domain=0' (default ros2:,"
        " the team's network, $ROS_DOMAIN_ID or 0), distro=humble for that release; or"
        " foxglove:8765, a port of this machine for Foxglove",
    )


def _run(options: argparse.Namespace) -> int:
    begin_log(options, "bridge")
    team, endpoints, link = connection_of(options)
    with _output(options.to, team, endpoints) as output:
        _Following(team, endpoints, link, output).run(StopSignals())
    return 0


def _output(word: str, team: str, endpoints: Sequence[str]) -> Ros2Output | FoxgloveOutput:
    """Return the output that `word` names."""
    if not word.startswith((FOXGLOVE, SCHEME)):
        expected = f"expected {SCHEME}, or {FOXGLOVE}PORT such as {FOXGLOVE}8765"
        raise ArgumentError("--to", f"{expected}, got {word!r}")
    if not word.startswith(FOXGLOVE):
        return Ros2Output.of_team(Ros2Network.parse(word, endpoints), team)
    output = FoxgloveOutput.parse(word)
    _log.info("open %s in Foxglove (Foxglove WebSocket)", output.url)
    return output


class _Following:
    """Leaves what a team says at an output, each kind from a thread of its own."""

    def __init__(
        self,
        team: str,
        endpoints: Sequence[str],
        link: LinkSettings,
        output: Ros2Output | FoxgloveOutput,
    ) -> None:
        self._team = team
        self._from = {"connect": endpoints, "link": link}
        self._output = output
        self._shown: set[str] = set()
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
        waits = time.monotonic() + PATIENCE
        while not (stopping() or self._over.wait(POLL)):
            if time.monotonic() > waits:
                waits = math.inf
                self._tell_missing()
        self._over.set()
        for thread in threads:
            thread.join(FAREWELL)
        if self._failure is not None:
            raise self._failure

    def _follow(self, subscribe: Callable[..., Iterator[JointMap | PoseMessage]]) -> None:
        try:
            for news in subscribe(self._team, **self._from, stopping=self._over.is_set):
                self._tell_shown(news)
                self._output.tell(news)
        except BaseException as error:  # noqa: BLE001 - raised again where it is seen
            self._failure = error
            self._over.set()

    def _tell_missing(self) -> None:
        if not self._shown:
            _log.warning(
                "nothing yet of team %s: waits for a joint map, which mapweave server makes, and"
                " for robots; mapweave watch --team %s tells who is there",
                self._team,
                self._team,
            )

    def _tell_shown(self, news: JointMap | PoseMessage) -> None:
        """Say of each kind of news once that it is shown."""
        if isinstance(news, JointMap):
            kind, what = "joint map", f"the joint map, from version {news.version} on"
        else:
            kind = what = f"where {news.robot} is"
        if kind not in self._shown:
            self._shown.add(kind)
            _log.info("shows %s", what)


command = Command(
    "Show a team's joint map and poses on a ROS 2 network, or in Foxglove.",
    _configure,
    _run,
    "--team rescue --to 'ros2:?connect=tcp/localhost:7447'",
)
