"""Where lone beams come back from one place in scan after scan, the lost ones ended there."""

import numpy as np
from numpy.typing import NDArray

from mapweave.geometry.arrays import FloatArray
from mapweave.scan.faint_surfaces import FaintSurfaceParameters, up_to_faint_surfaces
from mapweave.scan.scan import Scan
from tests.mapweave.buildings import cast, rectangle, walls_of

P = FaintSurfaceParameters()
ROOM = walls_of(rectangle(0, 0, 6, 4))  # its wall at x = 6 is a pane from y = 1 to y = 3
POSES = np.array([[x, y, 0.2 * y] for x in (1.0, 2.0, 3.0, 4.0) for y in (1.0, 2.0, 3.0)])


def at_pane(pose: FloatArray, whole: Scan) -> NDArray[np.bool_]:
    """Tell which beams go to the pane."""
    angle = pose[2] + whole.angles
    x, y = (pose[:2] + whole.ranges[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])).T
    return np.asarray((np.abs(x - 6) < 1e-6) & (y > 1) & (y < 3))


def seen(share: float, *, wide: FloatArray = ROOM) -> tuple[list[Scan], list[Scan]]:
    """Return scans of the room at `POSES` as they would be, and with a pane that returns little."""
    rng = np.random.default_rng(0)
    whole = [cast(wide, pose, index=k) for k, pose in enumerate(POSES)]
    paned = []
    for pose, scan in zip(POSES, whole, strict=True):
        lost = at_pane(pose, scan) & (rng.random(len(scan.ranges)) > share)
        ranges = np.where(lost, np.nan, scan.ranges)
        paned.append(Scan(ranges, scan.angles, scan.index, 0.0))
    return whole, paned


def test_beams_that_a_pane_swallows_end_at_it_and_not_beyond() -> None:
    whole, paned = seen(0.15)
    ended = 0
    for scan, short, filled in zip(
        whole, paned, up_to_faint_surfaces(paned, POSES, P), strict=True
    ):
        lost = np.isnan(short.ranges)
        np.testing.assert_array_equal(filled.ranges[~lost], short.ranges[~lost])
        off = scan.ranges[lost] - filled.ranges[lost]
        found = np.isfinite(off)
        ended += int(np.count_nonzero(found))
        assert (off[found] > -P.cell).all() and np.median(off[found]) < P.spread
    assert ended > 0.9 * sum(np.isnan(short.ranges).sum() for short in paned)


def test_into_an_opening_from_which_nothing_comes_back_beams_do_not_end() -> None:
    _, dark = seen(0.0)
    assert up_to_faint_surfaces(dark, POSES, P) == dark


def test_what_came_back_from_a_place_once_or_twice_is_no_surface() -> None:
    _, paned = seen(0.15)
    _, dark = seen(0.0)
    mostly_dark = [*paned[:2], *dark[2:]]
    for before, after in zip(mostly_dark, up_to_faint_surfaces(mostly_dark, POSES, P), strict=True):
        np.testing.assert_array_equal(before.ranges, after.ranges)


def test_a_beam_that_is_lost_on_something_before_the_pane_does_not_end_at_it() -> None:
    """A black box that others saw stands between: what is behind it was not seen from here."""
    _, paned = seen(0.15)
    box = walls_of(rectangle(4.8, 1.6, 5.2, 2.4))
    before_box = cast(np.vstack([ROOM, box]), POSES[1])
    at_box = before_box.ranges < seen(1.0)[0][1].ranges - 0.3
    blind = paned[1].ranges.copy()
    blind[at_box] = np.nan
    sees_it = cast(np.vstack([ROOM, box]), POSES[7], index=50)
    scans = [*paned, Scan(blind, paned[1].angles, 51, 0.0), sees_it]
    poses = np.vstack([POSES, POSES[[1, 7]]])
    filled = up_to_faint_surfaces(scans, poses, P)[-2]
    through = at_box & (np.abs(np.arange(len(at_box)) - np.flatnonzero(at_box).mean()) < 3)
    assert through.any() and np.isnan(filled.ranges[through]).all()
