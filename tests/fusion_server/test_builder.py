"""Versions are built in a thread of their own, as the configuration says."""

import time

from mapweave.config import Config, Mapping
from mapweave.maps import JointMap
from mapweave.team.joining import JointParameters
from mapweave.team.joint_builder import JointMapBuilder
from mapweave_fusion_server.builder import VersionBuilder
from mapweave_fusion_server.draft import Draft

GIVEN: list[JointParameters] = []


class Noting(Draft):
    """A draft that notes what it is built with."""

    def build(self, builder: JointMapBuilder) -> JointMap:
        """Return a map of nothing."""
        GIVEN.append(builder.parameters)
        return JointMap(self.version, (), ())


def test_a_version_is_built_with_what_the_configuration_says() -> None:
    config = Config(mapping=Mapping(max_gap=0.7))
    with VersionBuilder("series", config) as builder:
        builder.start(Noting(1, (), ()), time.time())
        built = builder.take()
    assert built is not None
    assert built.joint.version == 1
    assert [JointParameters.of(config)] == GIVEN
