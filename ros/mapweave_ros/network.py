"""Which ROS 2 network: its router, its domain, and the release whose words are used there."""

import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from urllib.parse import parse_qsl

from mapweave_protocol.link.session import default_endpoints, session_config
from mapweave_ros.errors import Ros2NetworkError

SCHEME = "ros2:"
DOMAIN_VARIABLE = "ROS_DOMAIN_ID"
MAX_DOMAIN = 232  # of ROS 2
HUMBLE = "humble"
"""The release that knows no hashes of types."""

_NUMBER = re.compile(r"[0-9]{1,3}")
RELEASES = (HUMBLE, "iron", "jazzy", "kilted", "lyrical", "rolling")
_SETTINGS = {"connect", "domain", "distro"}


@dataclass(frozen=True, slots=True)
class Ros2Network:
    """A network of ROS 2 over Zenoh.

    Attributes
    ----------
    endpoints
        Of its router.
    domain
        The number that keeps robots on one network apart (``ROS_DOMAIN_ID``).
    hashed
        Whether keys name the hash of a type; not so in Humble.
    """

    endpoints: tuple[str, ...]
    domain: int = 0
    hashed: bool = True

    @classmethod
    def parse(
        cls,
        word: str,
        endpoints: Sequence[str] | None = None,
        environment: Mapping[str, str] = os.environ,
    ) -> "Ros2Network":
        """Return the network of ``ros2:`` with or without ``?connect=…&domain=…&distro=…``.

        Parameters
        ----------
        endpoints
            Where the router is if `word` does not say it; None for the usual place.
        environment
            Has the domain if `word` does not.

        Raises
        ------
        Ros2NetworkError
            If it is no such word.
        EndpointError
            If an endpoint is not one.
        """
        scheme, _, rest = word.partition("?")
        if scheme != SCHEME:
            raise Ros2NetworkError(word, f"{scheme!r} is not {SCHEME}")
        settings = dict(parse_qsl(rest, keep_blank_values=True))
        unknown = sorted(settings.keys() - _SETTINGS)
        if unknown:
            raise Ros2NetworkError(word, f"nothing is known of {unknown[0]!r}")
        reached = default_endpoints() if endpoints is None else tuple(endpoints)
        if "connect" in settings:
            reached = tuple(settings["connect"].split(","))
        session_config(reached)  # so that a wrong one is found now
        domain = settings.get("domain", environment.get(DOMAIN_VARIABLE) or "0")
        if not _NUMBER.fullmatch(domain) or int(domain) > MAX_DOMAIN:
            raise Ros2NetworkError(word, f"domain {domain!r} is no number from 0 to {MAX_DOMAIN}")
        release = settings.get("distro", "jazzy")
        if release not in RELEASES:
            raise Ros2NetworkError(word, f"distro {release!r} is none of {', '.join(RELEASES)}")
        return cls(reached, int(domain), hashed=release != HUMBLE)
