"""How much readings scatter is told by straight walls, however they lie."""

import numpy as np
import pytest

from mapweave.scan.range_noise import MAX_SIGMA, SCANS, RangeNoise, off_line
from mapweave.scan.scan import Scan

ANGLES = np.radians(np.arange(-90.0, 91.0))


def room(rng: np.random.Generator, sigma: float, turn: float = 0.3, whole: float = 0.0) -> Scan:
    """A room of 6 m by 4 m from its middle, turned; in steps of `whole` [m], if that is not 0."""
    looks = ANGLES + turn
    ranges = np.minimum(3 / np.maximum(np.abs(np.cos(looks)), 1e-9), 2 / np.abs(np.sin(looks)))
    ranges = ranges + rng.normal(0, sigma, len(ranges))
    return Scan(np.round(ranges / whole) * whole if whole else ranges, ANGLES)


def told(scans: list[Scan], assumed: float = 0.02) -> list[float]:
    noise = RangeNoise(assumed)
    return [sigma for scan in scans if (sigma := noise.watch(scan)) is not None]


@pytest.mark.parametrize("turn", np.linspace(0.05, 1.5, 6))
def test_nothing_lies_off_a_straight_wall_but_at_its_corners(
    rng: np.random.Generator, turn: float
) -> None:
    off = off_line(room(rng, 0.0, turn))
    assert (np.abs(off) > 1e-9).sum() <= 6  # two at each of three corners
    assert len(off) > 150


def test_beams_need_not_be_evenly_spaced(rng: np.random.Generator) -> None:
    angles = np.sort(rng.uniform(-0.5, 0.5, 80))
    np.testing.assert_allclose(off_line(Scan(2 / np.cos(angles - 0.2), angles)), 0.0, atol=1e-12)


@pytest.mark.parametrize("sigma", [0.04, 0.06, 0.08])
def test_it_is_the_standard_deviation_of_a_reading(rng: np.random.Generator, sigma: float) -> None:
    (found,) = told([room(rng, sigma, turn) for turn in np.linspace(0.1, 1.4, 2 * SCANS)])
    assert found == pytest.approx(sigma, rel=0.2)


@pytest.mark.parametrize(("sigma", "whole"), [(0.02, 0.0), (0.01, 0.01), (0.005, 0.05)])
def test_a_lidar_as_it_is_assumed_is_not_told_of(
    rng: np.random.Generator, sigma: float, whole: float
) -> None:
    for _ in range(20):
        assert not told([room(rng, sigma, rng.uniform(0, 1.5), whole) for _ in range(SCANS)])


def test_it_is_asked_once_and_blind_scans_are_not_counted(rng: np.random.Generator) -> None:
    blind = Scan(np.full(len(ANGLES), np.nan), ANGLES)
    noise = RangeNoise(0.02)
    scans = [room(rng, 0.1) for _ in range(SCANS)]
    found = [noise.watch(scan) for scan in [blind, *scans, *scans]]
    assert [sigma is not None for sigma in found] == [*[False] * SCANS, True, *[False] * SCANS]


def test_what_cannot_be_told_is_not(rng: np.random.Generator) -> None:
    few = Scan(np.array([2.0, 2.1, 2.0] * 4), np.linspace(-0.2, 0.2, 12))
    assert not told([few] * SCANS)
    assert told([room(rng, 0.5) for _ in range(SCANS)], 0.1) in ([], [MAX_SIGMA])
