"""What ``import mapweave`` offers: it works whatever was imported before, and loads little."""

import doctest
import importlib
import inspect
import pkgutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import mapweave
import mapweave.lines
import mapweave.scan
import mapweave.shape
from mapweave.errors import ArgumentError, FinishedError
from mapweave.fusion.align import FusionParameters
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.reasons import Reason, ReasonKind
from tests.mapweave.buildings import BUILDING, cast, scans_along, tour, walls_of

PACKAGES = ["mapweave", "mapweave.scan", "mapweave.lines", "mapweave.shape"]
MODULES_WITH_EXAMPLES = [
    "mapweave.fusion.align",
    "mapweave.lines.directions",
    "mapweave.lines.merging_cost",
    "mapweave.lines.polylines",
    "mapweave.mapping.mapper",
    "mapweave.scan.scan",
    "mapweave.scan.segmentation",
    "mapweave.shape.partial_match",
    "mapweave.shape.tangent_space",
    "mapweave.team.joint_map",
]
HEAVY = {"gtsam", "matplotlib", "zenoh", "scipy.signal"}
CORNER = [[0, 0], [3, 0], [3, 2]]
WAY = [(2.0, 1.0), (6.0, 1.0)]
ARC = np.linspace(-np.pi, np.pi, 360, endpoint=False)


def loaded_by(code: str) -> set[str]:
    """Return the modules that a fresh interpreter has loaded after `code`."""
    told = subprocess.run(
        [sys.executable, "-c", f"{code}\nimport sys\nprint(*sys.modules)"],
        capture_output=True,
        text=True,
        check=True,
    )
    return set(told.stdout.split())


@pytest.fixture(scope="module", autouse=True)
def everything_imported() -> None:
    """Import all modules of mapweave, each of which sets its name in its package."""
    for module in pkgutil.walk_packages(mapweave.__path__, "mapweave."):
        if not module.name.endswith("__main__"):
            importlib.import_module(module.name)


def robot_map(robot: str, way: list[tuple[float, float]], seed: int) -> mapweave.RobotMap:
    mapper = mapweave.Mapper(robot)
    for scan in scans_along(BUILDING, way, seed)[0]:
        mapper.add(scan)
    return mapper.finish()


def places(made: mapweave.RobotMap) -> FloatArray:
    """Return (n, 3) where the scans were taken, in the frame of the first."""
    assert made.components == [0]
    poses = np.vstack([se2.compose(s.pose, s.trajectory.pose) for s in made.submaps])
    return se2.between(poses[0], poses)


def test_importing_mapweave_loads_nothing_but_itself() -> None:
    loaded = loaded_by("import mapweave")
    assert loaded.isdisjoint({"numpy", "scipy", "shapely", "pydantic", *HEAVY})


def test_the_names_of_a_mapping_program_load_no_solver_and_no_drawing() -> None:
    names = "Scan, Mapper, RobotMap, JointMap, Alignment, read_scans, align, fuse, load, save, plot"
    loaded = loaded_by(f"from mapweave import {names}")
    assert "mapweave.mapping.mapper" in loaded
    assert loaded.isdisjoint({*HEAVY, "scipy.ndimage", "scipy.spatial", "scipy.sparse"})


def test_mapping_and_comparing_never_load_the_statistics_behind_signal_processing() -> None:
    code = """
import numpy as np, mapweave
mapper = mapweave.Mapper()
for _ in range(8):
    mapper.add(mapweave.Scan.of(1 + np.arange(181) % 90 / 30, -1.57, 0.01745))
mapweave.align(mapper.finish(), mapper.finish())
"""
    assert loaded_by(code).isdisjoint({*HEAVY, "scipy.stats"})


@pytest.mark.parametrize("package", PACKAGES)
def test_public_names_are_no_modules_whatever_was_imported(package: str) -> None:
    module = importlib.import_module(package)
    for name in module.__all__:
        public = getattr(module, name)
        assert callable(public), name
        assert (public.__name__, public.__module__.partition(".")[0]) == (name, "mapweave")
    assert set(module.__all__) <= set(dir(module))


@pytest.mark.parametrize("package", PACKAGES)
def test_public_names_say_what_they_are_and_take(package: str) -> None:
    module = importlib.import_module(package)
    for public in (getattr(module, name) for name in module.__all__):
        said = inspect.getdoc(public)
        assert said, public.__name__
        if inspect.isfunction(public):
            assert "arameters" in said, public.__name__


@pytest.mark.parametrize("module", MODULES_WITH_EXAMPLES)
def test_the_examples_in_docstrings_hold(module: str) -> None:
    failed, tried = doctest.testmod(importlib.import_module(module))
    assert failed == 0
    assert tried > 0


def test_an_unknown_name_is_an_attribute_error_that_names_it() -> None:
    with pytest.raises(AttributeError, match=r"module 'mapweave' has no attribute 'nothing'"):
        getattr(mapweave, "nothing")  # noqa: B009


def test_the_papers_pieces_are_called_with_lists() -> None:
    scan = mapweave.Scan.of([2.0] * 90, -0.7, 0.0155)
    assert mapweave.scan.extract_segments(scan).segments.shape[1] == 4
    assert [len(p) for p in mapweave.lines.generalized_polylines(CORNER)] == [2]
    assert mapweave.lines.merge_cost([0, 0, 1, 0], [0, 0.4, 1, 0.4]) == pytest.approx(0.3)
    assert mapweave.lines.merged_segment([0, 0, 1, 0], [1, 0, 3, 0]) == pytest.approx(
        np.array([[0, 0, 3, 0]])
    )
    assert mapweave.lines.main_directions(CORNER) == pytest.approx([0, np.pi / 2])
    assert mapweave.shape.complexity([[0, 0], [1, 0], [1, 1]]) == pytest.approx((np.pi / 4) ** 2)
    assert mapweave.shape.similarity(CORNER, CORNER) == (0, 0)
    assert mapweave.shape.best_match(CORNER, CORNER).similarity == 0


def test_maps_are_made_aligned_fused_kept_and_drawn(tmp_path: Path) -> None:
    a = robot_map("a", [(2, 1), (13, 1), (13, 5)], 1)
    b = robot_map("b", [(13, 5), (13, 1), (2, 1)], 2)
    (alignment,) = mapweave.align(a, b)
    assert alignment.decision == "accepted"
    joint = mapweave.fuse([a, b], [alignment])
    assert [sorted(c.robots) for c in joint.components] == [["a/0", "b/0"]]
    for some_map, kind in ((a, mapweave.RobotMap), (joint, mapweave.JointMap)):
        mapweave.save(some_map, tmp_path / "kept.json")
        assert isinstance(mapweave.load(tmp_path / "kept.json"), kind)
        mapweave.plot(some_map, tmp_path / "drawn.svg")
        mapweave.export(some_map, tmp_path / "drawn.geojson")
    assert (tmp_path / "drawn.svg").read_bytes().startswith(b"<?xml")


def test_maps_of_one_robot_and_alignments_of_others_are_not_fused() -> None:
    empty = mapweave.RobotMap("a", "0", 0, ())
    with pytest.raises(ArgumentError, match=r"^maps: .* two of robot 'a'"):
        mapweave.fuse([empty, empty])
    unlike = Reason(ReasonKind.NO_SHAPE)
    foreign = mapweave.Alignment("x/0", "y/0", np.zeros(3), "refused", 0.0, unlike)
    with pytest.raises(ArgumentError, match=r"^alignments: .* got 'x/0'"):
        mapweave.fuse([empty], [foreign])


def test_maps_and_alignments_that_can_be_gone_through_once_are_fused() -> None:
    """A generator that was used up by the checks would be no maps, and nothing would say so."""
    scans, _ = scans_along(BUILDING, [(2, 1), (4, 1)], 1)
    maps = []
    for robot in ("a", "b"):
        mapper = mapweave.Mapper(robot)
        for scan in scans:
            mapper.add(scan)
        maps.append(mapper.finish())
    found = mapweave.align(maps[0], maps[1])
    joint = mapweave.fuse((each for each in maps), (each for each in found))
    assert [set(c.robots) for c in joint.components] == [
        set(c.robots) for c in mapweave.fuse(maps, found).components
    ]
    assert {name for c in joint.components for name in c.robots} == {"a/0", "b/0"}
    assert len(joint.alignments) == len(found)


def test_maps_are_compared_as_the_configuration_says() -> None:
    made = robot_map("a", [(2, 1), (14, 1)], 1)
    config = mapweave.Config(mapping=mapweave.Mapping(min_confidence=0.999, closeness=0.1))
    by_hand = FusionParameters.of(config)
    other = robot_map("b", [(10, 1), (26, 1)], 2)
    (found,), (same,) = (
        mapweave.align(made, other, config=config),
        mapweave.align(made, other, by_hand),
    )
    (otherwise,) = mapweave.align(made, other)
    assert found.evidence == same.evidence != otherwise.evidence


def test_arguments_of_another_kind_are_refused_by_name(tmp_path: Path) -> None:
    empty, path = mapweave.RobotMap("a", "0", 0, ()), tmp_path / "drawn.svg"
    joint = mapweave.fuse([empty])
    wrong: list[tuple[str, Callable[..., object], list[object]]] = [
        ("config: expected Config, got dict", mapweave.Mapper, ["a", "0", None, None, {}]),
        ("scan: expected Scan, got list", mapweave.Mapper().add, [[1, 2]]),
        ("scan: expected Scan, got list", mapweave.scan.extract_segments, [[1, 2]]),
        ("other: expected RobotMap, got JointMap", mapweave.align, [empty, joint]),
        ("config: expected Config, got dict", mapweave.align, [empty, empty, None, {}]),
        (
            "parameters: expected FusionParameters",
            mapweave.align,
            [empty, empty, mapweave.Config()],
        ),
        ("maps: expected a list of RobotMap, got RobotMap", mapweave.fuse, [empty]),
        ("maps: expected RobotMap, got JointMap", mapweave.fuse, [[empty, joint]]),
        ("alignments: expected Alignment, got int", mapweave.fuse, [[empty], [3]]),
        ("config: expected Config, got dict", mapweave.fuse, [[empty], None, {}]),
        ("some_map: expected RobotMap or JointMap, got list", mapweave.save, [[empty], path]),
        ("some_map: expected RobotMap or JointMap, got str", mapweave.export, ["a.json", path]),
        ("some_map: expected RobotMap or JointMap, got str", mapweave.plot, ["a.json", path]),
        ("maps: expected Mapping, got list", mapweave.plot, [joint, path, [empty]]),
    ]
    for complaint, function, arguments in wrong:
        with pytest.raises(ArgumentError, match=f"^{complaint}"):
            function(*arguments)
    assert not path.exists()


@pytest.mark.parametrize(
    "angles",
    [ARC, ARC[::-1], np.linspace(-np.pi, np.pi, 361), np.linspace(0, 2 * np.pi, 361)[::-1]],
    ids=["full turn", "clockwise", "doubled beam", "clockwise from the back, doubled"],
)
def test_any_sensor_maps_its_way(angles: FloatArray) -> None:
    """Ranges and angles as lists, no index, no stamp; NaN and infinity among the ranges."""
    walls, mapper = walls_of(BUILDING), mapweave.Mapper()
    poses = np.array(list(tour(WAY, 0.35)))
    rng = np.random.default_rng(3)
    for pose in poses:
        seen = cast(walls, pose, angles=np.sort(angles), noise=rng)
        ranges = np.where(rng.random(len(angles)) < 0.01, np.inf, seen.ranges)
        given = ranges if angles[0] < angles[-1] else ranges[::-1]
        assert mapper.add(mapweave.Scan(given.tolist(), angles.tolist())).placed
    made = mapper.finish()
    truth = se2.between(poses[0], poses)
    np.testing.assert_allclose(places(made), truth, atol=0.05)
    assert [k for s in made.submaps for k in s.trajectory.scan_index] == list(range(len(poses)))


def test_a_finished_map_takes_no_more_scans_and_says_so() -> None:
    mapper = mapweave.Mapper("a")
    scans, _ = scans_along(BUILDING, [(2, 1), (4, 1)], 1)
    for scan in scans:
        mapper.add(scan)
    made = mapper.finish()
    with pytest.raises(FinishedError, match=r"map of robot 'a' is finished .* a new Mapper"):
        mapper.add(scans[0])
    assert mapper.finish().version == made.version


def test_scan_indices_ascend() -> None:
    mapper = mapweave.Mapper("a")
    mapper.add(mapweave.Scan([np.nan] * 3, [0, 0.1, 0.2], 7))
    with pytest.raises(ArgumentError, match=r"^scan: expected an index of 8 or more, got 7"):
        mapper.add(mapweave.Scan([np.nan] * 3, [0, 0.1, 0.2], 7))
