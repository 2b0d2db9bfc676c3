"""A number is used for one version, in whatever form that travels."""

from collections.abc import Mapping

import numpy as np

from benchmarks.faults.kills import times_used
from mapweave.maps import JointComponent, JointMap, LineMap
from mapweave_protocol.wire.messages import JointMapMessage

ROOM = LineMap(
    np.array([[0.0, 0.0, 5.0, 0.0], [5.0, 0.0, 5.0, 4.0]]), np.array([0, 0]), np.array([3, 3]), ()
)


def version(number: int, robots: Mapping[str, float]) -> JointMapMessage:
    """Return a version in which robots are as far along the x axis [m]."""
    placed = {name: np.array([x, 0.0, 0.0]) for name, x in robots.items()}
    component = JointComponent(placed, 1.0, ROOM, np.ones(2))
    return JointMapMessage.pack(JointMap(number, (component,), ()), "s")


def test_a_version_published_as_what_changed_and_again_whole_is_one() -> None:
    whole = version(2, {"a/0": 0.0, "b/0": 1.0})
    changed = whole.since(version(1, {"a/0": 0.0}))
    assert times_used([changed, changed, whole, whole]) == 1


def test_two_versions_of_one_number_are_two() -> None:
    first, second = version(2, {"a/0": 0.0}), version(2, {"a/0": 0.5})
    assert times_used([first, second]) == 2
    assert times_used([first, second.since(version(1, {"a/0": 0.0}))]) == 2
