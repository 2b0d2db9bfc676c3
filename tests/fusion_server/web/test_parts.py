"""What is told of a robot's own map."""

from collections.abc import Callable

from mapweave.maps import RobotMap
from mapweave_fusion_server.web.parts import scene_of


def test_a_component_is_found_by_its_whole_name(make_map: Callable[..., RobotMap]) -> None:
    maps = [make_map("a"), make_map("ab", components=2)]
    found = scene_of(maps, "ab/1")
    assert found is not None
    assert found.name == "ab/1"
    assert scene_of(maps, "a/1") is None
