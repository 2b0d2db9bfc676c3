"""How a file of scans is to be read."""

import re
import warnings
from collections.abc import Callable
from dataclasses import dataclass

from mapweave.io.readers.ros_bags.frames import StaticFrames


@dataclass(frozen=True, slots=True)
class ReadOptions:
    """What a caller may ask of a reader; each format takes what it knows of.

    Attributes
    ----------
    odometry
        Fill `Scan.odometry` where the file states a pose.
    angular_step
        Between beams [rad], where the file does not state it.
    topic
        Of a bag: the laser's topic, such as ``/scan``, or those of several, ``/front+/rear``; None
        takes the only one there is.
    on_warning
        Called once, after the last scan, if something was left out; of a live source, when it is.
    on_news
        Of a live source: told what is no cause for concern.
    odometry_topic
        Of a bag or a ROS 2 network: where odometry is said, such as ``/odom`` or ``/tf``; None
        takes the only one of a bag, where `odometry` asks for it.
    on_laser
        Of a bag: told before its first scan which frame the laser is in, and what is fixed to what;
        not of several lasers, whose views are of the middle of the robot.
    network
        Endpoints of the network that the reader is on, for sources that are on it as well.
    """

    odometry: bool = False
    angular_step: float | None = None
    topic: str | None = None
    on_warning: Callable[[str], None] = warnings.warn
    network: tuple[str, ...] | None = None
    odometry_topic: str | None = None
    on_laser: Callable[[str, StaticFrames], None] | None = None
    on_news: Callable[[str], None] = lambda _: None


@dataclass(frozen=True, slots=True)
class OdometryChoice:
    """Which odometry may help; none unless it is asked for.

    Attributes
    ----------
    prior
        Whether any may.
    topic
        Where it is said; None for what stands beside the scans.
    live
        Whether the topic is one of a ROS 2 network.
    """

    prior: bool = False
    topic: str | None = None
    live: bool = False

    @classmethod
    def parse(cls, text: str) -> "OdometryChoice":
        """Return what ``none``, ``prior``, ``/odom`` or ``ros2:/odom`` says.

        Raises
        ------
        ValueError
            If it says nothing like it.
        """
        if text in ("none", "prior"):
            return cls(text == "prior")
        topic = text.removeprefix("ros2:")
        if not re.fullmatch(r"(/[A-Za-z_][A-Za-z0-9_]*)+", topic):
            raise ValueError(f"{text!r}: expected none, prior, or a topic such as /odom")
        return cls(True, topic, topic != text)
