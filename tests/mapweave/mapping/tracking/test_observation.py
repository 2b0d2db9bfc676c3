"""A scan, prepared: its segments as generalized polylines, and points that know theirs."""

import numpy as np
from numpy.random import Generator

from mapweave.mapping.tracking.observation import ObservationParameters, observe
from mapweave.scan.points import left_normals
from mapweave.scan.segmentation import extract_segments
from tests.mapweave.buildings import AROUND, BUILDING, cast, rectangle, walls_of

ROOM = walls_of(rectangle(0, 0, 6, 4))


def test_the_lines_of_an_observation_are_the_scans_segments_by_polyline(rng: Generator) -> None:
    scan = cast(walls_of(BUILDING), [9, 1, 0.3], angles=AROUND, noise=rng)
    seen = observe(scan, ObservationParameters())
    found = extract_segments(scan).segments
    np.testing.assert_array_equal(np.unique(seen.lines.segments, axis=0), np.unique(found, axis=0))
    assert set(np.diff(seen.lines.polyline)) <= {0, 1}
    assert (seen.lines.support == 1).all()


def test_a_points_polyline_is_that_of_the_line_it_lies_on(rng: Generator) -> None:
    scan = cast(walls_of(BUILDING), [9, 1, 0.3], angles=AROUND, noise=rng)
    seen = observe(scan, ObservationParameters())
    lines = seen.lines
    for polyline in np.unique(lines.polyline):
        points = seen.on_lines.points[seen.on_lines.polyline == polyline]
        own = lines.segments[lines.polyline == polyline]
        normals = left_normals(own[:, 2:] - own[:, :2])
        across = np.abs(np.einsum("psj,sj->ps", points[:, None] - own[None, :, :2], normals))
        assert (across.min(axis=1) < 0.15).all()


def test_a_scan_that_shows_nothing_has_no_surface() -> None:
    blind = cast(ROOM, [1, 2, 0], max_range=0.5)
    seen = observe(blind, ObservationParameters())
    assert len(seen.oriented) == 0 and len(seen.lines.segments) == 0
