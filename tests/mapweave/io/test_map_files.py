"""Map files say exactly what the maps hold, and are refused in one line where they do not."""

import copy
import gzip
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from mapweave.errors import FileError
from mapweave.evidence import Evidence, RunnerUp
from mapweave.geometry.arrays import FloatArray
from mapweave.io.map_files import load, read_joint, read_map, save, write_joint, write_map
from mapweave.maps import (
    Alignment,
    JointComponent,
    JointMap,
    LineMap,
    MadeWith,
    RobotMap,
    Submap,
    Trajectory,
)
from mapweave.reasons import Reason, ReasonKind
from tests.alignment_strategies import alignments

MAP: dict[str, Any] = {
    "format": "mapweave/map/1",
    "robot": "r1",
    "boot": "5f",
    "version": 17,
    "submaps": [
        {
            "id": 0,
            "component": 0,
            "pose": [1, 2, 0.5],
            "polylines": [[[0, 0, 1, 0], [1, 0, 1, 2]], [[4, 4, 5, 5]]],
            "support": [[3, 4], [1]],
            "free_space": [[[0, 0], [1, 0], [1, 1]]],
            "trajectory": [[0, None, 0, 0, 0], [2, 17.5, 1, 0, 0.1]],
        }
    ],
}
JOINT: dict[str, Any] = {
    "format": "mapweave/joint/1",
    "version": 3,
    "alignments": [
        {
            "reference": "a/0",
            "other": "b/0",
            "transform": [1, 2, 0.5],
            "confidence": 0.97,
            "decision": "accepted",
            "reason": "30 m of wall in common",
            "evidence": {"common": 30.5, "residual": None},
            "runner_up": {"transform": [0, 0, 0], "distance": 7, "common": 2.5},
        }
    ],
    "components": [
        {
            "robots": {"a/0": [0, 0, 0], "b/0": [1, 2, 0.5]},
            "confidence": 0.97,
            "polylines": [[[0, 0, 1, 0], [1, 0, 1, 2]], [[4, 4, 5, 5]]],
            "support": [[3, 4], [1]],
            "segment_confidence": [[0.5, 1], [0]],
        }
    ],
}
JUDGED: dict[str, Any] = {
    "status": "revoked",
    "set_aside_by": [["a/0", "c/0"], ["c/0", "b/0"]],
    "revoked_in": 3,
    "cause": {
        "kind": "others_contradict",
        "distance": 9.123456789,
        "turn": 0.5,
        "found": {"kind": "convincing", "common": 30.5, "contradicted": 0.25},
    },
    "anchors": [[0, 7, 0.25, -1.5, 3.1], [2, 4, 0, 0, 0]],
    "at": [[3.5, 4.25], [-10, 2]],
}
TYPED = {
    **JOINT,
    "alignments": [
        {
            **JOINT["alignments"][0],
            **JUDGED,
            "decision": "ambiguous",
            "reason": "revoked in version 3: 9.1 m and 29° off what a/0-c/0 and c/0-b/0 say;"
            " 30 m of wall in common, 0.2 m contradicted; nothing else fits",
        }
    ],
}
SETTINGS = settings(
    max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)

Steps = list[str | int]


def floats(shape: tuple[int, ...]) -> st.SearchStrategy[FloatArray]:
    return arrays(np.float64, shape, elements=st.floats(-1e5, 1e5))


def counts(length: int) -> st.SearchStrategy[Any]:
    return arrays(np.int64, length, elements=st.integers(0, 2**53))


@st.composite
def walls(draw: st.DrawFn, count: int) -> FloatArray:
    """Some no longer than can be seen, and no shorter than is written."""
    segments = draw(floats((count, 4))) / 1e3
    segments[:, 2] += np.where(np.hypot(*(segments[:, 2:] - segments[:, :2]).T) < 1e-3, 1.0, 0.0)
    return segments


@st.composite
def line_maps(draw: st.DrawFn) -> LineMap:
    lengths = draw(st.lists(st.integers(1, 4), max_size=4))
    polygons = draw(st.lists(st.integers(3, 6), max_size=3))
    return LineMap(
        segments=draw(walls(sum(lengths))),
        polyline=np.repeat(np.arange(len(lengths)), lengths),
        support=draw(counts(sum(lengths))),
        free_space=tuple(draw(floats((corners, 2))) for corners in polygons),
    )


@st.composite
def robot_maps(draw: st.DrawFn) -> RobotMap:
    ids = sorted(draw(st.sets(st.integers(0, 99), max_size=3)))
    return RobotMap("r-1", "5f", draw(st.integers(0, 99)), tuple(draw(submaps(i)) for i in ids))


@st.composite
def submaps(draw: st.DrawFn, submap: int) -> Submap:
    scans = draw(st.integers(0, 4))
    stamps = draw(arrays(np.float64, scans, elements=st.floats(0, 2e9) | st.just(np.nan)))
    deviations = arrays(np.float64, (scans, 4), elements=st.floats(0, 9))
    trajectory = Trajectory(
        draw(counts(scans)), stamps, draw(floats((scans, 3))), draw(st.none() | deviations)
    )
    component = draw(st.integers(0, 3))
    return Submap(submap, component, draw(floats((3,))), draw(line_maps()), trajectory)


@st.composite
def joint_maps(draw: st.DrawFn) -> JointMap:
    return JointMap(
        version=draw(st.integers(0, 99)),
        components=tuple(draw(st.lists(joint_components(), max_size=2))),
        alignments=tuple(draw(st.lists(alignments(), max_size=2))),
    )


@st.composite
def joint_components(draw: st.DrawFn) -> JointComponent:
    lines = draw(line_maps())
    confidences = arrays(np.float64, len(lines.segments), elements=st.floats(0, 1))
    robots = {"a/0": draw(floats((3,))), "b/12": draw(floats((3,)))}
    return JointComponent(robots, draw(st.floats(0, 1)), lines, draw(confidences))


def assert_same(found: object, expected: object) -> None:
    """Assert that two values of the library are equal, numbers to 0.05 mm."""
    if isinstance(expected, (float, np.ndarray)):
        np.testing.assert_allclose(np.asarray(found), expected, rtol=0, atol=5.1e-5)
        assert np.asarray(found).dtype == np.asarray(expected).dtype
    elif isinstance(expected, (tuple, list)):
        assert isinstance(found, (tuple, list))
        for one, other in zip(found, expected, strict=True):
            assert_same(one, other)
    elif isinstance(expected, dict):
        assert isinstance(found, dict)
        assert list(found) == list(expected)
        assert_same(list(found.values()), list(expected.values()))
    elif hasattr(expected, "__dataclass_fields__"):
        assert type(found) is type(expected)
        for name in expected.__dataclass_fields__:
            assert_same(getattr(found, name), getattr(expected, name))
    else:
        assert found == expected


def write(tmp_path: Path, content: object) -> Path:
    path = tmp_path / "file.json"
    path.write_text(json.dumps(content))
    return path


def changed(content: dict[str, Any], steps: Steps, value: object) -> dict[str, Any]:
    """Return a copy of `content` with `value` at the end of `steps`."""
    result: Any = copy.deepcopy(content)
    place = result
    for step in steps[:-1]:
        place = place[step]
    place[steps[-1]] = value
    return dict(result)


def without(content: dict[str, Any], steps: Steps) -> dict[str, Any]:
    """Return a copy of `content` without what is at the end of `steps`."""
    result: Any = copy.deepcopy(content)
    place = result
    for step in steps[:-1]:
        place = place[step]
    del place[steps[-1]]
    return dict(result)


def refusal(read: Callable[[Path], object], path: Path) -> str:
    """Return why `path` is refused, after the file's name, in what must be one line."""
    with pytest.raises(FileError) as caught:
        read(path)
    message = str(caught.value)
    assert message.isprintable()
    assert message.startswith(f"{path}: ")
    return message.removeprefix(f"{path}: ")


@SETTINGS
@given(robot_map=robot_maps())
def test_a_robot_map_comes_back_as_it_was_written(robot_map: RobotMap, tmp_path: Path) -> None:
    write_map(tmp_path / "map.json", robot_map)
    assert_same(read_map(tmp_path / "map.json"), robot_map)
    assert_same(load(tmp_path / "map.json"), robot_map)


@SETTINGS
@given(joint=joint_maps())
def test_a_joint_map_comes_back_as_it_was_written(joint: JointMap, tmp_path: Path) -> None:
    write_joint(tmp_path / "joint.json", joint)
    found = read_joint(tmp_path / "joint.json")
    assert_same(found, joint)
    assert_same(load(tmp_path / "joint.json"), joint)
    for one, other in zip(found.alignments, joint.alignments, strict=True):
        assert (one.cause, one.status, one.reason) == (other.cause, other.status, other.reason)


def test_a_segment_without_a_length_is_no_wall_and_left_out(tmp_path: Path) -> None:
    point, wall = [1.0, 1.0, 1.0, 1.0], [0.0, 0.0, 4.0, 0.0]
    walls = {"polylines": [[point], [wall, point]], "support": [[3], [5, 7]]}
    a_map, joint = copy.deepcopy(MAP), copy.deepcopy(JOINT)
    a_map["submaps"][0] |= walls
    joint["components"][0] |= walls | {"segment_confidence": [[0.1], [0.5, 0.7]]}
    for name, content in (("map", a_map), ("joint", joint)):
        (tmp_path / name).write_text(json.dumps(content))
    read = read_joint(tmp_path / "joint").components[0]
    for lines in (read.map, read_map(tmp_path / "map").submaps[0].map):
        assert lines.segments.tolist() == [wall]
        assert lines.polyline.tolist() == [0]
        assert lines.support.tolist() == [5]
    assert read.segment_confidence.tolist() == [0.5]


def test_a_map_file_has_the_published_fields(tmp_path: Path) -> None:
    write_map(tmp_path / "map.json", read_map(write(tmp_path, MAP)))
    assert json.loads((tmp_path / "map.json").read_text()) == MAP


def test_a_joint_map_file_has_the_published_fields_and_the_free_space(tmp_path: Path) -> None:
    write_joint(tmp_path / "joint.json", read_joint(write(tmp_path, TYPED)))
    written = json.loads((tmp_path / "joint.json").read_text())
    searched = {"explored_m2": 0.0, "frontiers": []}
    assert searched.items() <= written["components"][0].items()
    for field in searched:
        del written["components"][0][field]
    assert written == changed(TYPED, ["components", 0, "free_space"], [])


def test_a_file_from_before_causes_were_typed_keeps_its_sentence(tmp_path: Path) -> None:
    write_joint(tmp_path / "joint.json", read_joint(write(tmp_path, JOINT)))
    (found,) = json.loads((tmp_path / "joint.json").read_text())["alignments"]
    assert found == {
        **JOINT["alignments"][0],
        "status": None,
        "set_aside_by": [],
        "revoked_in": None,
        "cause": {"kind": "words", "text": "30 m of wall in common"},
        "anchors": [],
        "at": [],
    }


@pytest.mark.parametrize("steps", [["kind"], ["found", "kind"]])
def test_of_a_cause_of_a_later_version_the_sentence_is_known(
    steps: list[str], tmp_path: Path
) -> None:
    later = changed(TYPED, ["alignments", 0, "cause", *steps], "foreseen")
    (found,) = read_joint(write(tmp_path, later)).alignments
    assert found.reason == TYPED["alignments"][0]["reason"]
    assert (found.cause.kind, found.status) == (ReasonKind.WORDS, None)


@pytest.mark.parametrize(
    "steps", [["evidence"], ["runner_up"], ["cause"], ["cause", "found"]], ids="/".join
)
def test_what_a_later_version_knows_of_an_alignment_is_ignored(
    steps: list[str], tmp_path: Path
) -> None:
    for value in (0.5, None, "red", [1, 2], {"a": 1}):
        later = changed(TYPED, ["alignments", 0, *steps, "colour"], value)
        write_joint(tmp_path / "joint.json", read_joint(write(tmp_path, later)))
        (found,) = json.loads((tmp_path / "joint.json").read_text())["alignments"]
        assert found == TYPED["alignments"][0]


CONFIG: dict[str, Any] = {
    "sensor": {"range_sigma": 0.0123456789, "rate": None},
    "mapping": {"patience": 5, "later": "a word"},
}
MADE_WITH = MadeWith("mapweave 7", CONFIG)


def test_what_a_map_was_made_with_comes_back_to_the_last_digit(tmp_path: Path) -> None:
    path = tmp_path / "map.json"
    write_map(path, RobotMap("r1", "5f", 1, (), MADE_WITH))
    assert read_map(path).made_with == MADE_WITH
    write_map(path, read_map(path))
    assert read_map(path).made_with == MADE_WITH
    write_joint(path, JointMap(1, (), (), MADE_WITH))
    assert read_joint(path).made_with == MADE_WITH


@pytest.mark.parametrize("content", [MAP, JOINT])
def test_a_file_that_does_not_say_what_it_was_made_with_is_read_and_says_nothing_later(
    content: dict[str, Any], tmp_path: Path
) -> None:
    path = tmp_path / "map.json"
    path.write_text(json.dumps(content))
    found = load(path)
    assert found.made_with is None
    save(found, path)
    assert "made_with" not in json.loads(path.read_text())


@pytest.mark.parametrize("wrong", [3, {"program": "x"}, {"program": 1, "config": {}}])
def test_what_does_not_tell_what_a_map_was_made_with_is_refused(
    wrong: object, tmp_path: Path
) -> None:
    path = tmp_path / "map.json"
    path.write_text(json.dumps({**MAP, "made_with": wrong}))
    with pytest.raises(FileError, match="made_with"):
        read_map(path)


def test_numbers_are_written_no_finer_than_they_mean(tmp_path: Path) -> None:
    fine = changed(MAP, ["submaps", 0, "pose"], [1 / 3, 2 / 3, 1 / 7])
    write_map(tmp_path / "map.json", read_map(write(tmp_path, fine)))
    assert '"pose":[0.3333,0.6667,0.142857]' in (tmp_path / "map.json").read_text()


def test_what_is_not_finite_is_written_as_null(tmp_path: Path) -> None:
    """An infinite ratio in the evidence must not make a file that no other program reads."""
    alignment = Alignment(
        "a/0", "b/0", np.zeros(3), "refused", 0.0,
        Reason(ReasonKind.LITTLE_COMMON, {"common": np.inf}), Evidence(residual=np.inf),
        RunnerUp(np.zeros(3), distance=np.float64(np.nan)),
    )  # fmt: skip
    write_joint(tmp_path / "joint.json", JointMap(1, (), (alignment,)))
    (found,) = json.loads((tmp_path / "joint.json").read_text())["alignments"]
    assert found["evidence"] == {"residual": None}
    assert found["runner_up"] == {"transform": [0, 0, 0], "distance": None}
    assert found["cause"] == {"kind": "little_common", "common": None}
    (read,) = read_joint(tmp_path / "joint.json").alignments
    assert np.isnan(read.cause.numbers["common"])


@pytest.mark.parametrize("content", [MAP, JOINT], ids=["map", "joint"])
def test_a_gzipped_file_is_read(content: dict[str, Any], tmp_path: Path) -> None:
    packed = tmp_path / "packed.json"
    packed.write_bytes(gzip.compress(json.dumps(content).encode()))
    assert_same(load(packed), load(write(tmp_path, content)))


@pytest.mark.parametrize("content", [MAP, JOINT], ids=["map", "joint"])
def test_fields_of_a_later_version_are_ignored(content: dict[str, Any], tmp_path: Path) -> None:
    expected = load(write(tmp_path, content))
    assert_same(load(write(tmp_path, {**content, "colour": "red"})), expected)


@pytest.mark.parametrize(
    ("content", "steps"),
    [(MAP, [name]) for name in MAP]
    + [(MAP, ["submaps", 0, name]) for name in MAP["submaps"][0]]
    + [(JOINT, [name]) for name in JOINT]
    + [(JOINT, ["alignments", 0, name]) for name in JOINT["alignments"][0]]
    + [(JOINT, ["alignments", 0, "runner_up", "transform"])]
    + [(JOINT, ["components", 0, name]) for name in JOINT["components"][0]],
)
def test_a_missing_field_is_named(content: dict[str, Any], steps: Steps, tmp_path: Path) -> None:
    path = "".join(f"[{step}]" if isinstance(step, int) else f".{step}" for step in steps)
    message = refusal(load, write(tmp_path, without(content, steps)))
    assert message.startswith(f"{path.removeprefix('.')}: is missing; expected a map file")


@pytest.mark.parametrize(
    ("content", "steps", "value", "place", "expected"),
    [
        (MAP, ["format"], "mapweave/map/2", "format", "'mapweave/map/1'"),
        (MAP, ["robot"], "R 1", "robot", "expected 1 to 32 characters"),
        (MAP, ["robot"], "r1\n", "robot", "expected 1 to 32 characters"),
        (MAP, ["version"], -1, "version", "greater than or equal to 0"),
        (MAP, ["version"], "17", "version", "valid integer"),
        (MAP, ["submaps"], {}, "submaps", "valid array"),
        (MAP, ["submaps", 0, "id"], True, "submaps[0].id", "valid integer"),
        (MAP, ["submaps", 0, "pose", 1], float("nan"), "submaps[0].pose[1]", "finite number"),
        (MAP, ["submaps", 0, "pose", 2], float("inf"), "submaps[0].pose[2]", "finite number"),
        (MAP, ["submaps", 0, "pose", 0], 1e9, "submaps[0].pose[0]", "less than"),
        (MAP, ["submaps", 0, "polylines", 0, 0], [0, 0, 1e5, 0], "submaps[0].polylines", "1000 m"),
        (MAP, ["submaps", 0, "pose"], [1, 2], "submaps[0].pose[2]", "is missing"),
        (MAP, ["submaps", 0, "polylines", 1], [], "submaps[0].polylines[1]", "at least 1 item"),
        (MAP, ["submaps", 0, "support", 1], [1, 1], "submaps[0]", "support[1] has 2 numbers, exp"),
        (MAP, ["submaps", 0, "support"], [[3, 4]], "submaps[0]", "support has 1 lists, expected 2"),
        (MAP, ["submaps", 0, "free_space", 0], [[0, 0]], "submaps[0].free_space[0]", "at least 3"),
        (MAP, ["submaps", 0, "trajectory", 1, 0], 10**30, "submaps[0].trajectory[1][0]", "less"),
        (MAP, ["submaps", 0, "trajectory", 1, 1], float("inf"), "submaps[0].trajectory[1][1]", "f"),
        (MAP, ["submaps", 0, "uncertainty"], [[0.1] * 4], "submaps[0]", "has 1 rows, expected 2"),
        (MAP, ["submaps", 0, "uncertainty"], [[-1] * 4] * 2, "submaps[0].uncertainty[0]", "equal"),
        (MAP, ["submaps"], MAP["submaps"] * 2, "", "ids of submaps should ascend"),
        (JOINT, ["alignments", 0, "decision"], "maybe", "alignments[0].decision", "'refused'"),
        (JOINT, ["alignments", 0, "confidence"], 1.5, "alignments[0].confidence", "equal to 1"),
        (JOINT, ["alignments", 0, "other"], "b", "alignments[0].other", "pattern"),
        (JOINT, ["alignments", 0, "runner_up", "turn"], float("nan"),
         "alignments[0].runner_up.turn", "finite number"),
        (JOINT, ["alignments", 0, "evidence", "held"], "1", "alignments[0].evidence.held", "valid"),
        (TYPED, ["alignments", 0, "status"], "lost", "alignments[0].status", "'relied_on'"),
        (TYPED, ["alignments", 0, "status"], "held", "alignments[0]", "expected a version if"),
        (TYPED, ["alignments", 0, "revoked_in"], None, "alignments[0]", "expected a version if"),
        (TYPED, ["alignments", 0, "set_aside_by", 0], ["a/0"], "alignments[0].set_aside_by[0][1]",
         "is missing"),
        (TYPED, ["alignments", 0, "cause", "kind"], "rival", "alignments[0].cause",
         "reason rival: expected"),
        (TYPED, ["alignments", 0, "cause", "distance"], "9", "alignments[0].cause",
         "expected distance, turn"),
        (JOINT, ["components", 0, "robots"], {}, "components[0].robots", "at least 1 item"),
        (JOINT, ["components", 0, "robots"], {"a\n": [0] * 3}, "components[0].robots['a\\n']", ""),
        (JOINT, ["components", 0, "segment_confidence"], [[1], [1]], "components[0]",
         "segment_confidence[0] has 1 numbers, expected 2 as in polylines[0]"),
    ],
)  # fmt: skip
def test_a_wrong_value_is_named_with_what_was_expected(
    content: dict[str, Any], steps: Steps, value: object, place: str, expected: str, tmp_path: Path
) -> None:
    message = refusal(load, write(tmp_path, changed(content, steps, value)))
    assert message.startswith(place)
    assert expected in message


def test_the_other_kind_of_map_is_refused(tmp_path: Path) -> None:
    assert "'mapweave/joint/1', found 'mapweave/map/1'" in refusal(read_joint, write(tmp_path, MAP))
    assert "'mapweave/map/1', found 'mapweave/joint/1'" in refusal(read_map, write(tmp_path, JOINT))


@pytest.mark.parametrize(
    ("content", "problem"),
    [
        (b"", "is no JSON, or is cut off (at line 1 column"),
        (b"FLASER 1 2 3", "is no JSON, or is cut off (at line 1 column"),
        (b"\xff\xfe\x00", "is no JSON, or is cut off (at line 1 column"),
        (b"[" * 100_000, "is no JSON, or is cut off (at line 1 column"),
        (json.dumps(MAP).encode()[:-9], "is no JSON, or is cut off (at line 1 column"),
        (b"[]", "expected an object"),
        (gzip.compress(json.dumps(MAP).encode())[:-30], "the gzip stream is cut off"),
    ],
)
@pytest.mark.parametrize("read", [read_map, read_joint, load])
def test_what_is_no_map_file_is_refused(
    read: Callable[[Path], object], content: bytes, problem: str, tmp_path: Path
) -> None:
    path = tmp_path / "file.json"
    path.write_bytes(content)
    message = refusal(read, path)
    assert problem in message
    assert message.endswith("expected a map file (mapweave/map/1 or mapweave/joint/1)")


def test_no_refusal_speaks_in_the_words_of_a_library(tmp_path: Path) -> None:
    refusals = [
        refusal(read_map, write(tmp_path, JOINT)),
        refusal(load, write(tmp_path, {**MAP, "version": "x"})),
        refusal(load, write(tmp_path, without(MAP, ["robot"]))),
    ]
    assert refusals[0].startswith("format: expected 'mapweave/map/1', found 'mapweave/joint/1'")
    assert not [r for r in refusals if "Input" in r or "Field" in r or "JSON:" in r]


@pytest.mark.parametrize("read", [read_map, read_joint, load])
def test_a_missing_file_and_a_folder_are_refused(
    read: Callable[[Path], object], tmp_path: Path
) -> None:
    assert refusal(read, tmp_path / "missing.json").startswith("cannot be read (No such file")
    assert refusal(read, tmp_path).startswith("cannot be read (Is a directory)")


def test_a_joint_map_file_says_what_was_searched_and_where_it_goes_on(tmp_path: Path) -> None:
    ring = [[0.0, 0.0], [3.0, 0.0], [3.0, 2.0], [0.0, 2.0]]
    searched = changed(TYPED, ["components", 0, "free_space"], [ring])
    write_joint(tmp_path / "joint.json", read_joint(write(tmp_path, searched)))
    component = json.loads((tmp_path / "joint.json").read_text())["components"][0]
    assert component["explored_m2"] == 6.0
    assert [3.0, 2.0] in [point for line in component["frontiers"] for point in line]
