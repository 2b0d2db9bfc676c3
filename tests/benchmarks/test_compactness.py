"""What counts as doubled, as a sliver and as meeting."""

from pathlib import Path

import numpy as np
import pytest

from benchmarks.compactness import compactness
from benchmarks.coverage import explained_share, returns_at
from benchmarks.mapping import merge, segments_of
from benchmarks.runs import map_scans
from benchmarks.truth import paths
from mapweave.io.readers import read_scans

WALL = [0.0, 0.0, 4.0, 0.0]


def doubled(*others: list[float]) -> float:
    return compactness(np.array([WALL, *others])).doubled


@pytest.mark.parametrize(
    ("other", "share"),
    [
        ([0.0, 0.1, 4.0, 0.1], 1.0),
        ([0.0, -0.25, 4.0, -0.25], 1.0),
        ([2.0, 0.1, 4.0, 0.1], 4 / 6),  # half of the wall, all of the other
        ([0.0, 0.01, 4.0, 0.01], 0.0),  # within the noise
        ([0.0, 0.4, 4.0, 0.4], 0.0),  # another wall
        ([4.0, 0.1, 0.0, 0.1], 0.0),  # the opposite face
        ([4.1, 0.1, 8.0, 0.1], 0.0),  # goes on, displaced
        ([2.0, 0.1, 2.0, 3.0], 0.0),  # across
    ],
)
def test_doubled_is_what_has_the_same_face_close_before_or_behind(
    other: list[float], share: float
) -> None:
    assert doubled(other) == pytest.approx(share, abs=0.02)


def test_slivers_and_meeting_ends_are_counted() -> None:
    found = compactness(np.array([WALL, [4.0, 0.0, 4.0, 0.2], [9.0, 9.0, 12.0, 9.0]]))
    assert (found.segments, found.slivers) == (3, 1)
    assert found.meeting == pytest.approx(2 / 6)
    assert found.length == pytest.approx(7.2)


@pytest.mark.slow
def test_130_segments_explain_97_percent_of_a_real_building_and_double_no_wall(
    data_dir: Path,
) -> None:
    scans = list(read_scans(data_dir / "seattle.log.gz", on_warning=print))
    robot_map = map_scans("seattle", scans).robot_map
    path = paths(robot_map)[0]
    lines = segments_of(merge(robot_map), path.component)
    seen = returns_at([scans[k] for k in path.index], path.pose)
    assert explained_share(seen, lines) >= 0.97
    found = compactness(lines)
    assert found.segments <= 130
    assert found.doubled < 0.01
