"""What stands free and is short may move; walls, and what is before nothing, do not."""

import numpy as np
import pytest

from mapweave.scan.loose_things import loose_things
from tests.mapweave.buildings import FRONT, cast, rectangle, walls_of

ROOM = walls_of(rectangle(-4, -4, 6, 4))


def thing(x: float, y: float, width: float) -> np.ndarray:
    """Return the (4, 4) faces of a square thing in the middle of a room."""
    half = width / 2
    return walls_of(rectangle(x - half, y - half, x + half, y + half)[::-1])


@pytest.mark.parametrize("width", [0.15, 0.4, 0.6])
def test_what_stands_free_and_is_short_is_loose_and_all_else_is_not(width: float) -> None:
    walls = np.vstack([ROOM, thing(2.0, 0.3, width)])
    scan = cast(walls, (0, 0, 0), angles=FRONT)
    loose = loose_things(scan, 1.0, 0.25) >= 0
    near = np.hypot(*(scan.points - (2.0, 0.3)).T) < width
    assert near.any() and (loose == near).all()


def test_what_is_long_is_not_loose() -> None:
    scan = cast(np.vstack([ROOM, thing(3.0, 0.0, 1.5)]), (0, 0, 0), angles=FRONT)
    assert (loose_things(scan, 1.0, 0.25) == -1).all()


def test_a_wall_between_two_things_before_it_is_not_loose() -> None:
    walls = np.vstack([ROOM, thing(2.0, -0.6, 0.4), thing(2.0, 0.6, 0.4)])
    scan = cast(walls, (0, 0, 0), angles=FRONT)
    straight_on = len(FRONT) // 2
    found = loose_things(scan, 1.0, 0.25)
    assert found[straight_on] == -1 and len(set(found[found >= 0].tolist())) == 2


def test_nothing_is_loose_where_hardly_anything_is_seen() -> None:
    scan = cast(ROOM, (0, 0, 0), angles=FRONT, max_range=0.5)
    assert (loose_things(scan, 1.0, 0.25) == -1).all()
