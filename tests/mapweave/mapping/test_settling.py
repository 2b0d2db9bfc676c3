"""A running robot whose backend is late maps what a log gives: finished submaps wait, not scans."""

from dataclasses import replace

import numpy as np
import pytest

from mapweave.geometry import se2
from mapweave.mapping import settling
from mapweave.mapping.backend import Backend, BackendParameters, BackendResult, FinishedSubmap
from mapweave.mapping.mapper import Mapper
from mapweave.maps import RobotMap
from mapweave.scan.scan import Scan
from tests.mapweave.buildings import BUILDING, OTHER_BUILDING, scans_along

MOVED = 0.3  # [m]
THERE_AND_BACK = [(1, 1), (29, 1), (1, 1.2), (29, 1)]


class Late:
    """A backend that is done `lag` scans after a submap was handed over; a test counts these."""

    def __init__(self, lag: float) -> None:
        self._backend = Backend(BackendParameters())
        self._lag = lag
        self._begun = 0
        self.scans = 0
        self.handed_over: list[FinishedSubmap] = []

    def begin(self, finished: FinishedSubmap) -> None:
        """Take the next submap."""
        self.handed_over.append(finished)
        self._backend.begin(finished)
        self._begun = self.scans

    @property
    def is_ready(self) -> bool:
        """Whether it would be done."""
        return self.scans - self._begun >= self._lag

    def take(self) -> BackendResult:
        """Return the outcome."""
        settled = self._backend.take()
        assert settled is not None
        return settled


class Moving(Late):
    """Finds with each submap that all of them are farther to the left."""

    def take(self) -> BackendResult:
        """Return them moved."""
        settled = super().take()
        aside = np.array([0.0, MOVED, 0.0])
        renewed = tuple(replace(s, pose=s.pose + aside) for s in settled.renewed)
        return replace(settled, pose=settled.pose + aside, renewed=renewed)


def mapped(scans: list[Scan], backend: Late, *, live: bool = True) -> tuple[RobotMap, list[int]]:
    """Return the map, and how many submaps it had after each scan."""
    mapper = Mapper("a", backend=backend, live=live)
    counts = []
    for scan in scans:
        mapper.add(scan)
        backend.scans += 1
        counts.append(len(mapper.snapshot().finished))
    return mapper.finish(), counts


def spans(robot_map: RobotMap) -> list[tuple[int, list[int]]]:
    """Return the component and the scans of each submap."""
    return [(s.component, s.trajectory.scan_index.tolist()) for s in robot_map.submaps]


def furthest(one: RobotMap, other: RobotMap) -> tuple[float, float]:
    """Return how far scans lie from where they lie in another map, at most: [m], [°]."""
    poses = [
        np.concatenate([se2.compose(s.pose, s.trajectory.pose) for s in each.submaps])
        for each in (one, other)
    ]
    off = se2.between(*poses)
    return float(np.hypot(off[:, 0], off[:, 1]).max()), float(np.degrees(np.abs(off[:, 2])).max())


@pytest.fixture(scope="module")
def drive() -> list[Scan]:
    """Return scans of a drive along a building, back, and along it again."""
    return scans_along(BUILDING, THERE_AND_BACK, 1)[0]


@pytest.fixture(scope="module")
def on_time(drive: list[Scan]) -> RobotMap:
    """Return what they give where each submap is settled before the next one is finished."""
    return mapped(drive, Late(0), live=False)[0]


@pytest.mark.parametrize("lag", [45, 150])
def test_a_late_backend_gives_the_same_submaps_at_the_same_places(
    drive: list[Scan], on_time: RobotMap, lag: int
) -> None:
    late, _ = mapped(drive, Late(lag))
    assert len(on_time.submaps) >= 6
    assert spans(late) == spans(on_time)
    metres, degrees = furthest(late, on_time)
    assert metres <= 0.01
    assert degrees <= 0.1
    assert [s.id for s in late.submaps] == list(range(len(late.submaps)))


def test_a_submap_is_handed_over_where_it_is_since_those_before_it_settled(
    drive: list[Scan],
) -> None:
    """Else each would be joined and closed from where tracking had it, apart from the others."""
    late, on_time = Moving(80), Moving(0)
    for backend, live in ((late, True), (on_time, False)):
        mapped(drive, backend, live=live)
    poses = [np.array([f.submap.pose for f in each.handed_over]) for each in (late, on_time)]
    assert len(poses[0]) >= 6
    assert poses[1][-1, 1] > 5 * MOVED  # all that settled before it moved it
    np.testing.assert_allclose(poses[0], poses[1], atol=0.01)


def test_a_robot_that_is_lost_while_submaps_wait_shares_no_number_with_what_it_leaves() -> None:
    out, _ = scans_along(BUILDING, [(1, 1), (29, 1)], 1)
    away, _ = scans_along(OTHER_BUILDING, [(5, 1.5), (9, 1.5), (9, -3)], 2)
    scans = [Scan(s.ranges, s.angles, k, s.stamp) for k, s in enumerate([*out, *away])]
    late, on_time = (mapped(scans, Late(lag))[0] for lag in (100, 0))
    assert [indices for _, indices in spans(late)] == [indices for _, indices in spans(on_time)]
    assert len(late.components) == len(on_time.components) == 2


def test_no_scan_waits_where_more_submaps_would_queue_than_may(
    drive: list[Scan], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The growing one grows on: no scan is lost, and memory is bounded."""
    monkeypatch.setattr(settling, "MOST_LATE", 3)
    robot_map, counts = mapped(drive, Late(np.inf))
    assert max(counts) == 3
    assert sorted(k for _, indices in spans(robot_map) for k in indices) == list(range(len(drive)))
