"""What the benchmark of teams measures with."""

import numpy as np
import pytest

from benchmarks.team import fit_frame, is_held
from mapweave.geometry import se2
from mapweave.maps import Alignment
from mapweave.reasons import Reason
from mapweave.team.alignment_graph import Cluster
from tests.mapweave.buildings import random_pose


def alignment(reference: str, other: str) -> Alignment:
    return Alignment(reference, other, np.zeros(3), "accepted", 0.9, Reason.words(""))


def test_the_frame_that_fits_is_the_motion_that_was_made() -> None:
    rng = np.random.default_rng(1)
    points, motion = rng.uniform(-9, 9, (20, 2)), random_pose(rng)
    np.testing.assert_allclose(
        fit_frame(points, se2.transform_points(motion, points)), motion, atol=1e-9
    )


@pytest.mark.parametrize(
    ("links", "held"),
    [
        ("ac", False),
        ("ab bc", False),
        ("ab bc ac", True),
        ("ab bc ad dc", True),
        ("ab bd dc bc", False),
    ],
)
def test_held_twice_is_what_two_ways_without_a_common_link_join(links: str, held: bool) -> None:
    """Between a and c."""
    judged = [alignment(f"{pair[0]}/0", f"{pair[1]}/0") for pair in links.split()]
    cluster = Cluster({f"{robot}/0": np.zeros(3) for robot in "abcd"}, 1.0)
    assert is_held(cluster, judged, alignment("a/0", "c/0"), 2) == held
