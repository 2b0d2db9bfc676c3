"""What takes the scans of one robot: a mapper, or a localizer in a map that is known."""

from typing import Protocol

from mapweave.mapping.placement import Placement
from mapweave.maps import RobotMap, Submap
from mapweave.scan.scan import Scan


class Drawable(Protocol):
    """A map at one moment, to be drawn by any thread."""

    @property
    def submaps(self) -> tuple[Submap, ...]:
        """All submaps where they are, the growing one without its lines."""

    def robot_map(self) -> RobotMap:
        """Draw it."""


class ScanMapper(Protocol):
    """Takes scans, one by one, and says where each was taken."""

    @property
    def robot(self) -> str:
        """The robot's id."""

    @property
    def boot(self) -> str:
        """Which run of it this is."""

    @property
    def followed(self) -> RobotMap | None:
        """The stored map in which it only follows the robot: of others' making; None if it maps."""

    def add(self, scan: Scan) -> Placement:
        """Take the next scan."""

    def finish(self) -> RobotMap:
        """Take no more, and return the map."""

    def robot_map(self) -> RobotMap:
        """Return the map so far."""

    def snapshot(self) -> Drawable:
        """Return what `robot_map` would draw now, within a moment."""
