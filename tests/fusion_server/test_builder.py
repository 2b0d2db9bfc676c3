"""Versions are built in a thread of their own, as the configuration says."""

import time

from mapweave.config import Config, Mapping
from mapweave.maps import JointMap
from mapweave.team.joint_map import JointParameters
from mapweave.team.joint_optimization import JointOptimizer
from mapweave_fusion_server.builder import VersionBuilder
from mapweave_fusion_server.coordinator import Draft

GIVEN: list[JointParameters | None] = []


class Noting(Draft):
    """A draft that notes what it is built with."""

    def build(self, weaver: JointOptimizer, parameters: JointParameters | None = None) -> JointMap:
        """Return a map of nothing."""
        assert isinstance(weaver, JointOptimizer)
        GIVEN.append(parameters)
        return JointMap(self.version, (), ())


def test_a_version_is_built_with_what_the_configuration_says() -> None:
    config = Config(mapping=Mapping(max_gap=0.7))
    with VersionBuilder("series", config) as builder:
        builder.start(Noting(1, (), ()), time.time())
        built = builder.take()
    assert built is not None
    assert built.joint.version == 1
    assert [JointParameters.of(config)] == GIVEN
