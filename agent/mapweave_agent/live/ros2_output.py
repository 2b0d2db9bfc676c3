"""An agent's own map and pose on a ROS 2 network, where that is asked for."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import TYPE_CHECKING

from mapweave.io.sources import Recording, ScanSource
from mapweave_agent.agent import Tell

if TYPE_CHECKING:  # an extra
    from mapweave_ros.robot.frames import RobotFrames


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
        Knows the robot's frames, if it is on a ROS 2 network or a bag.

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
    frames = source.frames if isinstance(source, Ros2Source) else frames_of_recording(source)
    with Ros2Output.of_robot(network, robot, frames) as output:
        yield output.tell


def frames_of_recording(source: ScanSource) -> "RobotFrames":
    """Return the frames that a bag says the robot has; of another source nothing is known."""
    from mapweave_ros.robot.frames import RobotFrames

    frames = RobotFrames()
    if isinstance(source, Recording):
        quiet = replace(source.options, on_warning=lambda _: None)  # mapping it tells of it
        next(replace(source, options=quiet).scans(frames.laser_in_bag), None)
    return frames
