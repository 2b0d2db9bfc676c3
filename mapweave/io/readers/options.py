"""How a file of scans is to be read."""

import warnings
from collections.abc import Callable
from dataclasses import dataclass


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
        Of a bag: the laser's topic, such as ``/scan``; None takes the only one there is.
    on_warning
        Called once, after the last scan, if something was left out; of a live source, when it is.
    network
        Endpoints of the network that the reader is on, for sources that are on it as well.
    """

    odometry: bool = False
    angular_step: float | None = None
    topic: str | None = None
    on_warning: Callable[[str], None] = warnings.warn
    network: tuple[str, ...] | None = None
