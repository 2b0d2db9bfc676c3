"""Views of several lasers."""

import numpy as np

from mapweave.scan.mounting import Mounting
from mapweave.scan.scan import Scan
from mapweave.scan.several_lasers import SeveralLasers

ANGLES = np.radians(np.arange(-90.0, 91.0))
SIDES = {"/left": Mounting(0.0, 0.3, np.pi / 2), "/right": Mounting(0.0, -0.3, -np.pi / 2)}


def scan(stamp: float, distance: float = 1.0) -> Scan:
    return Scan(np.full(len(ANGLES), distance), ANGLES, stamp=stamp)


def views(*said: tuple[str, float]) -> list[Scan]:
    together = SeveralLasers(SIDES)
    return [view for topic, stamp in said for view in together.add(topic, scan(stamp))]


def test_scans_of_one_time_are_one_view_in_whatever_order_they_come() -> None:
    said = [("/left", 0.0), ("/right", 0.02), ("/right", 0.12), ("/left", 0.1)]
    assert [view.stamp for view in views(*said)] == [0.02, 0.12]
    assert [view.index for view in views(*said)] == [0, 1]
    assert all(view.hits.sum() > 250 for view in views(*said))


def test_a_laser_that_has_failed_holds_the_other_up_for_a_period_only() -> None:
    said = [("/left", 0.0), ("/right", 0.0), ("/left", 0.1), ("/left", 0.2), ("/left", 0.3)]
    assert [view.stamp for view in views(*said)] == [0.0, 0.1, 0.2]


def test_what_was_taken_half_a_period_earlier_is_no_part_of_a_view() -> None:
    said = [("/left", 0.0), ("/right", 0.0), ("/right", 0.1), ("/left", 0.16)]
    whole, half = views(*said)
    assert whole.hits.sum() > 1.8 * half.hits.sum()
    left = half.points[half.hits]
    assert (left[:, 1] > 0).all()


def test_stamps_that_stand_still_say_that_all_belongs_together() -> None:
    said = [("/left", 0.0), ("/right", 0.0)] * 3
    assert [view.hits.sum() > 250 for view in views(*said)] == [True] * 3


def test_of_two_returns_in_one_direction_the_nearer_one_is_seen() -> None:
    together = SeveralLasers({"/a": Mounting(), "/b": Mounting()})
    list(together.add("/a", scan(0.0, 3.0)))
    (view,) = together.add("/b", scan(0.0, 2.0))
    assert set(view.ranges[view.hits].round(9)) == {2.0}


def test_a_view_is_where_its_points_are_whatever_hangs_upside_down() -> None:
    hanging = SeveralLasers({"/a": Mounting(1.0, 2.0, 0.5, upside_down=True), "/b": Mounting()})
    seen = Scan([4.0, np.nan] * 6, np.radians(np.arange(0.0, 60.0, 5.0)), stamp=0.0)
    nothing = Scan(np.full(12, np.nan), seen.angles, stamp=0.0)
    list(hanging.add("/a", seen))
    (view,) = hanging.add("/b", nothing)
    expected = [1.0, 2.0] + 4.0 * np.column_stack(
        [np.cos(0.5 - seen.angles), np.sin(0.5 - seen.angles)]
    )
    points = view.points[view.hits]
    apart = np.linalg.norm(points[:, None] - expected[seen.hits][None], axis=2).min(axis=1)
    assert len(points) == 6
    assert (apart < np.radians(5.0) * 6.0).all()
