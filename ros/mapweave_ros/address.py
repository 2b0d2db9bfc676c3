"""A word such as ``ros2:/front@0.2,0,0+/rear@-0.2,0,180?domain=7``, taken apart."""

import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from mapweave.scan.mounting import Mounting
from mapweave_ros.errors import Ros2SourceError
from mapweave_ros.network import SCHEME, Ros2Network

_TOPIC = re.compile(r"(/[A-Za-z_][A-Za-z0-9_]*)+")


@dataclass(frozen=True, slots=True)
class Laser:
    """A laser's topic, and where the laser is on the robot; None where ``/tf_static`` says it."""

    topic: str
    mounting: Mounting | None = None


@dataclass(frozen=True, slots=True)
class Ros2Address:
    """Lasers of one robot, and the network on which they are.

    Attributes
    ----------
    lasers
        One or several.
    network
        Where.
    """

    lasers: tuple[Laser, ...]
    network: Ros2Network

    @classmethod
    def parse(
        cls,
        name: str,
        endpoints: Sequence[str] | None = None,
        environment: Mapping[str, str] = os.environ,
    ) -> "Ros2Address":
        """Return what `name` says; parameters as of `Ros2Network.parse`.

        Raises
        ------
        Ros2SourceError, Ros2NetworkError
            If it is no such word.
        EndpointError
            If an endpoint is not one.
        """
        topics, _, settings = name.removeprefix(SCHEME).partition("?")
        lasers = tuple(_laser(name, text) for text in topics.split("+"))
        _check_lasers(name, lasers)
        network = Ros2Network.parse(f"{SCHEME}?{settings}", endpoints, environment)
        return cls(lasers, network)


def _laser(name: str, text: str) -> Laser:
    topic, at, place = text.partition("@")
    if not _TOPIC.fullmatch(topic):
        raise Ros2SourceError(name, f"{topic!r} is no topic such as /scan")
    try:
        return Laser(topic, Mounting.parse(place) if at else None)
    except ValueError as error:
        raise Ros2SourceError(name, f"{place!r} is no mounting such as 0.2,0,90") from error


def _check_lasers(name: str, lasers: Sequence[Laser]) -> None:
    topics = [laser.topic for laser in lasers]
    if len(set(topics)) < len(topics):
        raise Ros2SourceError(name, "names a topic twice")
