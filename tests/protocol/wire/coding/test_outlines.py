"""Areas on whole numbers, whatever their corners are like when opened and straightened."""

import numpy as np
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely.geometry import Polygon

from mapweave.geometry.arrays import FloatArray
from mapweave_protocol.wire.coding.outlines import straightened

DEPTH, DEVIATION = 1.2, 1.0

# Mitred and grown again, the two are not apart any more, as GEOS wants parts of one area to be.
TAPERING = [
    np.array(
        [
            [22.183166883469617, 65.21416880992989],
            [23.685933609017333, 62.15775061724313],
            [9.802455388239773, 50.149044088511765],
            [21.729249749588817, 73.92301254693479],
        ]
    ),
    np.array(
        [
            [17.984586667514847, 54.68319968739757],
            [9.684251219813653, 59.496849372993225],
            [22.384717072238953, 64.69745925370712],
            [22.962714296692443, 63.63743026895055],
            [23.19885459603463, 62.005180974563636],
            [25.899326439603055, 63.3270931585207],
        ]
    ),
]


def test_tapering_parts_that_lie_on_each_other_when_opened_make_valid_areas() -> None:
    areas = straightened(TAPERING, DEPTH, DEVIATION)
    assert areas
    for outside, *holes in areas:
        assert Polygon(outside, holes).is_valid


@st.composite
def stars(draw: st.DrawFn) -> list[FloatArray]:
    """Return what was seen from several places, as beams of random lengths have it."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    found = []
    for _ in range(draw(st.integers(1, 4))):
        angles = np.sort(rng.uniform(0, 2 * np.pi, draw(st.integers(4, 40))))
        ends = rng.uniform(1, 30, len(angles))[:, None] * np.column_stack(
            [np.cos(angles), np.sin(angles)]
        )
        star = Polygon(rng.uniform(0, 40, 2) + ends)
        if star.is_valid:
            found.append(star)
    parts = shapely.get_parts(shapely.union_all(found))
    return [np.array(part.exterior.coords)[:-1] for part in parts]


@settings(deadline=None, max_examples=100)
@given(stars())
def test_whatever_was_seen_its_areas_are_valid_and_none_reaches_far_beyond(
    seen: list[FloatArray],
) -> None:
    allowed = shapely.union_all([Polygon(ring) for ring in seen]).buffer(DEVIATION + 1.0)
    for outside, *holes in straightened(seen, DEPTH, DEVIATION):
        area = Polygon(outside, holes)
        assert area.is_valid
        assert allowed.covers(area)


def test_an_outline_that_runs_back_on_itself_has_the_area_beside() -> None:
    spiked = np.array([[0, 0], [40, 0], [40, 20], [60, 20], [40, 20], [40, 40], [0, 40]], float)
    [(outside,)] = straightened([spiked], DEPTH, DEVIATION)
    assert Polygon(outside).equals(shapely.box(0, 0, 40, 40))


@given(
    outlines=st.lists(
        st.lists(st.tuples(*[st.integers(-40, 40)] * 2), min_size=3, max_size=9),
        min_size=1,
        max_size=3,
    )
)
@settings(max_examples=150, deadline=None)
def test_outlines_that_cross_make_areas_as_well(outlines: list[list[tuple[int, int]]]) -> None:
    for outside, *holes in straightened(
        [np.array(each) / 2 for each in outlines], DEPTH, DEVIATION
    ):
        assert Polygon(outside, holes).is_valid
