"""The keys under which ROS 2 says things on Zenoh.

`rmw_zenoh` publishes at ``<domain>/<topic>/<type>/<hash>``, the type as DDS names it; the hash is
that of REP 2016, or, from Humble, the words ``TypeHashNotSupported``. `zenoh-bridge-ros2dds`
publishes at the topic's name. Both leave out the slash that the topic begins with.
"""

from dataclasses import dataclass

from mapweave.io.readers.ros_bags.laser_messages import LASER_SCAN

TYPE_HASH_NOT_SUPPORTED = "TypeHashNotSupported"


def dds_type_of(kind: str) -> str:
    """Return how DDS names a type such as ``sensor_msgs/msg/LaserScan``."""
    package, _, name = kind.split("/")
    return f"{package}::msg::dds_::{name}_"


DDS_LASER_SCAN = dds_type_of(LASER_SCAN)


@dataclass(frozen=True, slots=True)
class TopicKeys:
    """Where a topic may be heard.

    Attributes
    ----------
    topic
        Such as ``/scan``.
    domain
        Of `rmw_zenoh`; the bridge's keys have none.
    """

    topic: str
    domain: int

    @property
    def bridged(self) -> str:
        """The key of `zenoh-bridge-ros2dds`."""
        return self.topic.removeprefix("/")

    @property
    def native(self) -> str:
        """The key expression of `rmw_zenoh`, of any type and hash."""
        return f"{self.domain}/{self.bridged}/*/*"

    def type_at(self, key: str) -> str | None:
        """Return the type that `key` names, as DDS does; None where it is the bridge's."""
        return None if key == self.bridged else key.split("/")[-2]
