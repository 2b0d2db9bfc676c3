"""All scans of a run are kept, or none."""

import numpy as np

from mapweave.mapping.raw_scans import RawScans
from mapweave.scan.scan import Scan


def scan(index: int) -> Scan:
    """Return a scan that is told by its number."""
    return Scan(np.full(4, 1.0), np.linspace(-1.0, 1.0, 4), index, 0.1 * index)


def test_few_scans_are_kept_in_order_until_they_are_taken() -> None:
    scans = RawScans(3)
    for k in range(3):
        scans.add(scan(k))
    assert scans.are_whole
    assert [each.index for each in scans.take()] == [0, 1, 2]
    assert scans.take() == []
    assert scans.are_whole  # those that were taken are added again


def test_of_a_run_with_more_scans_none_is_kept_any_more() -> None:
    scans = RawScans(3)
    for k in range(5):
        scans.add(scan(k))
    assert not scans.are_whole
    assert scans.take() == []
