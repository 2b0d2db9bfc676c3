"""``A:B`` names scans A to B - 1 of a log, counted from 0; either may be left out."""

import pytest

from mapweave.io.scan_range import ScanRange
from tests.mapweave.buildings import cast, rectangle, walls_of

SCANS = [cast(walls_of(rectangle(0, 0, 6, 4)), [1, 2, 0], index=k) for k in range(6)]


@pytest.mark.parametrize(
    ("text", "chosen"),
    [(":", [0, 1, 2, 3, 4, 5]), ("3:", [3, 4, 5]), (":2", [0, 1]), ("3:4", [3]), ("4:99", [4, 5]),
     ("7:", []), ("0:1", [0])],
)  # fmt: skip
def test_it_selects_as_python_slices_do_and_counts_what_it_selects(
    text: str, chosen: list[int]
) -> None:
    selected = ScanRange.parse(text)
    assert [scan.index for scan in selected.of(SCANS)] == chosen
    assert selected.count(len(SCANS)) == len(chosen)
    assert ScanRange.parse(str(selected)) == selected


@pytest.mark.parametrize(
    "text", ["", "3", "4:4", "4:3", "-1:3", "1:-1", "a:b", "1:2:3", " 1:2", "1.0:2", "1:9999999999"]
)
def test_what_is_no_range_is_refused_and_told_what_was_expected(text: str) -> None:
    with pytest.raises(ValueError, match="expected A:B"):
        ScanRange.parse(text)
