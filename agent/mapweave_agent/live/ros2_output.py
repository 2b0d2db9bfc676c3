"""An agent's own map and pose on a ROS 2 network, where that is asked for."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from mapweave.io.sources import ScanSource
from mapweave_agent.agent import Tell


@contextmanager
def output_of(
    word: str | None, robot: str, endpoints: Sequence[str], source: ScanSource
) -> Iterator[Tell]:
    """Give a block what takes maps and poses for the network that `word` says.

    Parameters
    ----------
    word
        As of `Ros2Network.parse`; None for no network.
    robot
        The robot's id.
    endpoints
        Where the router is unless `word` says it.
    source
        Knows the robot's frames, if it is on a ROS 2 network.

    Raises
    ------
    Ros2NetworkError
        If `word` is none.
    MissingExtraError
        If `rosbags` is not installed.
    """
    if word is None:
        yield lambda _: None
        return
    from mapweave_ros.network import Ros2Network
    from mapweave_ros.output import Ros2Output
    from mapweave_ros.source import Ros2Source

    network = Ros2Network.parse(word, endpoints)
    frames = source.frames if isinstance(source, Ros2Source) else None
    with Ros2Output.of_robot(network, robot, frames) as output:
        yield output.tell
