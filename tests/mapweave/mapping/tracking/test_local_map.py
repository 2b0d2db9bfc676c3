"""Where a scan should show known walls it does, or it looks through them."""

import numpy as np
import pytest

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.mapping.tracking.local_map import LocalMap
from mapweave.mapping.tracking.observation import Observation, ObservationParameters, observe
from mapweave.mapping.tracking.tracker import TrackerParameters
from mapweave.scan.scan import Scan
from tests.mapweave.buildings import cast, rectangle, walls_of

HERE = np.array([1.0, 2.0, 0.0])  # looks along the room
ROOM = walls_of(rectangle(0, 0, 6, 4))
LONGER = walls_of(rectangle(0, 0, 12, 4))
BEAMS_AHEAD = 2 * np.degrees(np.arctan2(2, 5))  # on the end wall, of 180


def observed(scan: Scan) -> Observation:
    return observe(scan, ObservationParameters())


def remembered(*seen: tuple[Observation, FloatArray]) -> LocalMap:
    local = LocalMap(TrackerParameters().local_map)
    for each, pose in seen:
        local.remember(each.scan, each.walls, each.loose, pose, spared=False, held=True)
    return local


def known() -> LocalMap:
    return remembered((observed(cast(ROOM, HERE)), HERE))


def test_what_is_as_it_was_is_not_looked_through() -> None:
    assert known().looked_through(cast(ROOM, HERE), HERE) == 0


def test_walls_that_should_be_seen_and_are_not_are_looked_through() -> None:
    through = known().looked_through(cast(LONGER, HERE), HERE)
    assert through == pytest.approx(BEAMS_AHEAD, abs=6)


def test_what_lies_behind_tells_nothing_however_much_there_is_of_it() -> None:
    back = se2.compose(HERE, [0, 0, np.pi])
    local = remembered((observed(cast(ROOM, HERE)), HERE), (observed(cast(ROOM, back)), back))
    longer = cast(LONGER, HERE)
    alone = known().looked_through(longer, HERE)
    assert local.looked_through(longer, HERE) == pytest.approx(alone, abs=4)


def test_where_somebody_stood_who_went_on_nothing_is_looked_through() -> None:
    """Even where the wall behind is not where it was."""
    somebody = walls_of(rectangle(2.5, 1.8, 2.9, 2.2))
    seen = observed(cast(np.vstack([ROOM, somebody]), HERE))
    local = remembered((seen, HERE))
    assert seen.loose.any()
    longer = cast(LONGER, HERE)
    assert local.looked_through(longer, HERE) <= known().looked_through(longer, HERE)


def test_what_a_copy_remembers_is_not_known_to_the_first() -> None:
    behind = se2.compose(HERE, [0, 0, np.pi])
    local = remembered((observed(cast(ROOM, behind)), behind))
    copy = local.copy()
    seen = observed(cast(ROOM, HERE))
    copy.remember(seen.scan, seen.walls, seen.loose, HERE, spared=False, held=True)
    longer = cast(LONGER, HERE)
    assert copy.looked_through(longer, HERE) > 10 > local.looked_through(longer, HERE)
