"""A word such as ``ros2:/front@0.2,0,0+/rear@-0.2,0,180?domain=7``, taken apart."""

import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from urllib.parse import parse_qsl

from mapweave_protocol.link.session import default_endpoints, session_config
from mapweave_ros.errors import Ros2SourceError
from mapweave_ros.mounting import Mounting

SCHEME = "ros2:"
DOMAIN_VARIABLE = "ROS_DOMAIN_ID"
MAX_DOMAIN = 232  # of ROS 2
_TOPIC = re.compile(r"(/[A-Za-z_][A-Za-z0-9_]*)+")
_NUMBER = re.compile(r"[0-9]{1,3}")


@dataclass(frozen=True, slots=True)
class Laser:
    """A laser's topic, and where the laser is on the robot; None where that was not said."""

    topic: str
    mounting: Mounting | None = None


@dataclass(frozen=True, slots=True)
class Ros2Address:
    """Lasers of one robot, and the network on which they are.

    Attributes
    ----------
    lasers
        One, or several that each say where they sit.
    endpoints
        Of the network's router.
    domain
        The number that keeps robots on one network apart (``ROS_DOMAIN_ID``).
    """

    lasers: tuple[Laser, ...]
    endpoints: tuple[str, ...]
    domain: int

    @classmethod
    def parse(
        cls,
        name: str,
        endpoints: Sequence[str] | None = None,
        environment: Mapping[str, str] = os.environ,
    ) -> "Ros2Address":
        """Return what `name` says.

        Parameters
        ----------
        endpoints
            Where the router is if `name` does not say it; None for the usual place.
        environment
            Has the domain if `name` does not.

        Raises
        ------
        Ros2SourceError
            If it is no such word.
        EndpointError
            If an endpoint is not one.
        """
        topics, _, query = name.removeprefix(SCHEME).partition("?")
        settings = dict(parse_qsl(query, keep_blank_values=True))
        unknown = sorted(settings.keys() - {"connect", "domain"})
        if unknown:
            raise Ros2SourceError(name, f"nothing is known of {unknown[0]!r}")
        lasers = tuple(_laser(name, text) for text in topics.split("+"))
        _check_lasers(name, lasers)
        asked = settings.get("connect")
        reached = default_endpoints() if endpoints is None else tuple(endpoints)
        if asked is not None:
            reached = tuple(asked.split(","))
        session_config(reached)  # so that a wrong one is found now
        domain = settings.get("domain", environment.get(DOMAIN_VARIABLE) or "0")
        return cls(lasers, reached, _domain(name, domain))


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
    bare = [laser.topic for laser in lasers if laser.mounting is None]
    if len(lasers) > 1 and bare:
        raise Ros2SourceError(name, f"of several lasers, {bare[0]} does not say where it sits")


def _domain(name: str, text: str) -> int:
    if not _NUMBER.fullmatch(text) or int(text) > MAX_DOMAIN:
        raise Ros2SourceError(name, f"domain {text!r} is no number from 0 to {MAX_DOMAIN}")
    return int(text)
