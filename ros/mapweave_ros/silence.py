"""Topics of which nothing is heard: told once each time, with what there is instead."""

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass

SILENT = 5.0  # [s] without a message, after which that is said


@dataclass(frozen=True, slots=True)
class Expected:
    """What is to come at a topic.

    Attributes
    ----------
    what
        In a word, such as ``scan``.
    kind
        The type of its messages, such as ``sensor_msgs/msg/LaserScan``.
    """

    what: str
    kind: str


class Silence:
    """Watches over topics, each on its own: one laser of two may be the one that is silent.

    Parameters
    ----------
    expected
        What is to come at each topic.
    domain
        Of ROS 2.
    announced
        Returns domain and name of each topic that somebody announces, of a type.
    tell, tell_news
        Told which topic is silent, and when it is no longer.
    clock
        Returns the time [s].
    """

    def __init__(
        self,
        expected: Mapping[str, Expected],
        domain: int,
        announced: Callable[[str], list[tuple[int, str]]],
        tell: Callable[[str], None],
        tell_news: Callable[[str], None],
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._expected = expected
        self._domain = domain
        self._announced = announced
        self._tell = tell
        self._tell_news = tell_news
        self._clock = clock
        self._last = dict.fromkeys(expected, clock())
        self._came: set[str] = set()
        self._told: set[str] = set()

    def heard(self, topic: str) -> None:
        """Note a message at `topic`; of one that is not expected nothing is noted."""
        if topic not in self._expected:
            return
        self._last[topic] = self._clock()
        self._came.add(topic)
        if topic in self._told:
            self._told.remove(topic)
            self._tell_news(f"{topic} is heard now")

    def check(self) -> None:
        """Tell of each topic that has been silent for `SILENT`."""
        now = self._clock()
        for topic, last in self._last.items():
            if now - last > SILENT and topic not in self._told:
                self._told.add(topic)
                self._tell(self._words(topic))

    def _words(self, topic: str) -> str:
        expected = self._expected[topic]
        since = f"for {SILENT:g} s" if topic in self._came else "yet"
        where = f"no {expected.what} {since} at {topic} in domain {self._domain}"
        return f"{where}; of topics with {expected.kind.split('/')[-1]} {self._there(expected)}"

    def _there(self, expected: Expected) -> str:
        """Tell what is announced in this domain, or else in others."""
        there = self._announced(expected.kind)
        here = [topic for domain, topic in there if domain == self._domain]
        elsewhere = [f"{topic} in domain {domain}" for domain, topic in there]
        if not there:
            return "none is announced (rmw_zenoh does, zenoh-bridge-ros2dds does not)"
        return f"those announced are {', '.join(here or elsewhere)}"
