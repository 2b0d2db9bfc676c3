"""One laser of a topic: a robot's lasers may all say their scans at one, told apart by frames.

Localizers of ROS take them so. Whoever maps would see the room ahead and the room behind in turns,
as of a robot that turns round with each scan.
"""

import math

from mapweave.io.readers.ros_bags.frames import frame_name

GONE = 5.0  # [s] without a scan, after which another frame is its new name, or a laser that is left


class OneLaser:
    """Keeps to the laser whose scan came first.

    Attributes
    ----------
    frame
        Its frame; None before the first scan.
    """

    def __init__(self) -> None:
        self.frame: str | None = None
        self._last = math.nan  # when its last scan was taken

    def has_taken(self, frame: str, stamp: float) -> bool:
        """Tell whether it took the scan that has `frame` and `stamp` [s]."""
        name = frame_name(frame)
        is_another = self.frame not in (None, name)
        if is_another and not stamp - self._last > GONE:  # nor where the time is not known
            return False
        self.frame, self._last = name, stamp
        return True
