"""A scan's points are where its beams ended, in the sensor's frame."""

import numpy as np

from mapweave.scan.scan import Scan


def test_ahead_is_x_and_left_is_y() -> None:
    scan = Scan(np.array([1.0, 2.0, 3.0]), np.array([-np.pi / 2, 0.0, np.pi / 2]))
    np.testing.assert_allclose(scan.points, [[0, -1], [2, 0], [0, 3]], atol=1e-12)


def test_a_beam_that_did_not_come_back_has_no_point() -> None:
    scan = Scan(np.array([np.nan, 2.0]), np.array([0.0, 0.1]))
    assert scan.hits.tolist() == [False, True]
    assert np.isnan(scan.points[0]).all() and np.isfinite(scan.points[1]).all()
