"""A driver that feeds an agent: ``python own_driver.py ROBOT TEAM [ENDPOINT]``.

Needs a router and a coordinator, as ``mapweave router`` and ``mapweave server`` start them. The
lidar is a pretended one, in a bare room: put what reads yours in the place of `sweeps`.
"""

import sys
import time
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

import mapweave_agent
from mapweave import JointMap

ANGLES = np.radians(np.arange(-179.5, 180.0))
ROOM = np.array([8.0, 5.0])  # [m]


def sweeps() -> Iterator[tuple[float, NDArray[np.float64]]]:
    """Yield when each was taken [s], and its ranges [m]."""
    ahead = np.column_stack([np.cos(ANGLES), np.sin(ANGLES)])
    for x in np.arange(1.0, 4.0, 0.05):
        to_walls = np.where(ahead > 0, ROOM - [x, 2.0], [-x, -2.0]) / ahead
        yield time.time(), to_walls.min(axis=1)
        time.sleep(0.1)


def tell(joint: JointMap) -> None:
    """Say what the team knows."""
    walls = {" + ".join(one.robots): len(one.map.segments) for one in joint.components}
    print(f"version {joint.version}: {walls}", flush=True)


if __name__ == "__main__":  # the agent starts processes of its own, which load this file, too
    if len(sys.argv) < 3:
        raise SystemExit("usage: python own_driver.py ROBOT TEAM [ENDPOINT]")
    robot, team, *endpoints = sys.argv[1:]
    with mapweave_agent.Agent(robot, team, connect=endpoints or None, on_joint_map=tell) as agent:
        for stamp, ranges in sweeps():
            agent.feed(ranges, ANGLES[0], ANGLES[1] - ANGLES[0], stamp)
    print(f"mapped, {agent.skipped} scans skipped")
