"""What is remembered of maps and comparisons holds as long as what it comes of."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.runs import COMPARING, MAPPING, sources
from benchmarks.scale import remembered
from benchmarks.scale.made_up import robots_of
from benchmarks.scale.remembered import compare_remembered, fingerprint
from mapweave.fusion.align import FusionParameters
from mapweave.maps import Alignment, RobotMap


def test_sources_are_those_that_a_module_imports_and_no_others() -> None:
    assert sources(COMPARING) == sources(COMPARING, "mapweave.fusion.places")
    assert sources("mapweave.errors") != sources(COMPARING)
    assert sources(MAPPING) != sources(MAPPING, "mapweave.commands.fuse")


def test_two_maps_are_compared_once_and_others_anew(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    asked = list[tuple[RobotMap, RobotMap]]()

    def counted(one: RobotMap, other: RobotMap, _: FusionParameters) -> list[Alignment]:
        asked.append((one, other))
        return []

    monkeypatch.setattr(remembered, "CACHE", tmp_path)
    monkeypatch.setattr(remembered, "align", counted)
    p, (one, other, third) = FusionParameters(), robots_of(0, 3)[0]
    first = compare_remembered(one, other, p)
    assert compare_remembered(one, other, p) == first
    assert asked == [(one, other)]
    compare_remembered(one, third, p)
    assert asked == [(one, other), (one, third)]


def test_a_map_whose_walls_free_space_or_poses_differ_is_another() -> None:
    robot_map = robots_of(0, 1)[0][0]
    first, *rest = robot_map.submaps
    lines = first.map
    others = [
        replace(first, pose=np.array([0.0, 0.0, 1e-9])),
        replace(first, map=replace(lines, segments=lines.segments + 1e-9)),
        replace(first, map=replace(lines, free_space=lines.free_space[1:])),
    ]
    names = {fingerprint(replace(robot_map, submaps=(other, *rest))) for other in others}
    assert len(names | {fingerprint(robot_map)}) == 4
    assert fingerprint(robot_map) == fingerprint(replace(robot_map, version=7))
