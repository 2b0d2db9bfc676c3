"""Maps are drawn in another process: the same lines, also when it dies."""

import os
import signal
from dataclasses import replace

import numpy as np
import pytest

from mapweave.mapping.mapper import Mapper
from mapweave.maps import LineMap, RobotMap
from mapweave_agent.live.drawing_process import DrawingProcess
from tests.mapweave.buildings import BUILDING, scans_along


def lines_of(robot_map: RobotMap) -> list[LineMap]:
    return [submap.map for submap in robot_map.submaps]


@pytest.mark.parametrize("killed", [False, True])
def test_a_live_map_is_the_same_drawn_here_or_beside(killed: bool) -> None:
    with DrawingProcess() as drawing:
        mapper, here = Mapper(draw=drawing.draw), Mapper()
        for scan in scans_along(BUILDING, [(3, 1), (28, 1)], 1)[0]:
            mapper.add(scan)
            here.add(scan)
        if killed:
            os.kill(drawing.pid, signal.SIGKILL)
        beside = lines_of(mapper.snapshot().robot_map())
        again = lines_of(mapper.snapshot().robot_map())
    expected = lines_of(here.snapshot().robot_map())
    assert len(expected) > 1
    for drawn in (beside, again):
        for one, other in zip(drawn, expected, strict=True):
            np.testing.assert_array_equal(one.segments, other.segments)
            np.testing.assert_array_equal(one.support, other.support)
            assert len(one.free_space) == len(other.free_space)


def test_what_is_being_settled_is_drawn_once() -> None:
    drawn: list[bytes] = []
    mapper = Mapper()
    for scan in scans_along(BUILDING, [(3, 1), (28, 1)], 1)[0]:
        mapper.add(scan)
    snapshot = mapper.snapshot()
    assert snapshot.unsettled

    def draw(builder: bytes) -> LineMap:
        drawn.append(builder)
        return LineMap.empty()

    counted = replace(snapshot, growing=None, draw=draw)
    for _ in range(2):
        counted.robot_map()
    assert len(drawn) == 1
