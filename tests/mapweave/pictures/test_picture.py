"""Pictures show what the map holds, to scale, and say so."""

import re
import struct
import subprocess
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest
import shapely
from numpy.random import Generator

from mapweave.errors import FileError
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.maps import JointMap, LineMap, RobotMap, Submap, Trajectory
from mapweave.pictures.drawing import ROBOT_COLOURS
from mapweave.pictures.figure import round_length
from mapweave.pictures.layout import arrange, upright
from mapweave.pictures.picture import draw_joint, draw_map
from mapweave.pictures.scene import Scene, robot_scenes
from mapweave.scan.free_space import from_rings
from tests.mapweave.buildings import line_map, random_pose, rectangle, walls_of
from tests.mapweave.whole_maps import joint_map, robot_map, true_poses

SVG = "{http://www.w3.org/2000/svg}"


def test_a_label_in_letters_that_no_font_has_is_no_warning(rng: Generator, tmp_path: Path) -> None:
    draw_map(robot_map(rng), tmp_path / "map.png", title="\u65e5\u672c")  # warnings are errors


def svg(path: Path) -> ET.Element:
    return ET.parse(path).getroot()


def lines_of(picture: ET.Element, group: str) -> list[tuple[FloatArray, str]]:
    """Return the points and the style of each line in the group of that name."""
    found = next(g for g in picture.iter(f"{SVG}g") if g.get("id") == group)
    return [
        (
            np.array(re.findall(r"[-\d.e]+", line.get("d", "")), dtype=float).reshape(-1, 2),
            line.get("style", ""),
        )
        for line in found.iter(f"{SVG}path")
    ]


def words_of(picture: ET.Element) -> str:
    return " | ".join("".join(text.itertext()) for text in picture.iter(f"{SVG}text"))


def scale_of(picture: ET.Element) -> float:
    """Return the picture's scale as its scale bar tells [units/m]."""
    ((bar, _),) = lines_of(picture, "scale-bar")
    metres = re.search(r"([\d.]+) m(?: \||$)", words_of(picture))
    assert metres is not None
    return float(np.ptp(bar[:, 0])) / float(metres[1])


def lengths(segments: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.norm(segments[:, 2:] - segments[:, :2], axis=1))


def scene_of(corners: FloatArray, name: str = "a/0") -> Scene:
    return Scene(name, {name: np.append(corners[0], 0.0)}, line_map(walls_of(corners)), {}, ())


def test_the_picture_has_each_wall_once_to_the_scale_of_its_bar(
    rng: Generator, tmp_path: Path
) -> None:
    known = robot_map(rng)
    draw_map(known, tmp_path / "map.svg")
    picture = svg(tmp_path / "map.svg")
    drawn = np.array([points.reshape(4) for points, _ in lines_of(picture, "walls-a/0")])
    expected = known.lines(0).segments
    assert len(drawn) == len(expected)
    np.testing.assert_allclose(
        np.sort(lengths(drawn)) / scale_of(picture), np.sort(lengths(expected)), atol=0.01
    )


def test_walls_and_path_lie_to_each_other_as_in_the_map(rng: Generator, tmp_path: Path) -> None:
    """The distances of every path point to the midpoints of all walls are the map's."""
    known = robot_map(rng)
    draw_map(known, tmp_path / "map.svg")
    picture = svg(tmp_path / "map.svg")
    scale = scale_of(picture)
    walls = np.array([points.mean(axis=0) for points, _ in lines_of(picture, "walls-a/0")])
    ((path, _),) = lines_of(picture, "path-a/0-0")
    (scene,) = robot_scenes(known)
    ends = scene.map.segments
    middles = (ends[:, :2] + ends[:, 2:]) / 2
    expected = distances(scene.paths[0].pose[:, :2], middles)
    np.testing.assert_allclose(distances(path, walls) / scale, expected, atol=0.01)


def test_the_floor_is_what_was_seen_to_be_free(rng: Generator, tmp_path: Path) -> None:
    """Its area is the area of the union, to scale: submaps overlap."""
    known = robot_map(rng)
    draw_map(known, tmp_path / "map.svg")
    picture = svg(tmp_path / "map.svg")
    ((outline, _),) = lines_of(picture, "floor-a/0")
    expected = from_rings(known.lines(0).free_space).area
    area = shapely.Polygon(outline).area / scale_of(picture) ** 2
    assert area == pytest.approx(expected, rel=0.02)


def distances(points: FloatArray, others: FloatArray) -> FloatArray:
    """Return the (n, m) distances, those of each point ascending."""
    return np.sort(np.linalg.norm(points[:, None] - others[None], axis=-1), axis=1)


def darkness(style: str) -> float:
    """Return 1 - the mean of red, green and blue of the line's colour."""
    colour = re.search(r"stroke: #([0-9a-f]{6})", style)
    assert colour is not None
    return 1 - sum(bytes.fromhex(colour[1])) / (3 * 255)


def test_a_wall_is_the_darker_the_more_scans_saw_it(tmp_path: Path) -> None:
    walls = walls_of(rectangle(0, 0, 9, 4))
    lines = LineMap(walls, np.zeros(4, dtype=np.int64), np.array([1, 20, 3, 8]))
    known = one_submap(lines)
    draw_map(known, tmp_path / "map.svg")
    drawn = lines_of(svg(tmp_path / "map.svg"), "walls-a/0")
    shades = [darkness(style) for _, style in drawn]
    assert shades == sorted(set(shades))  # drawn in this order, so that the well-seen are on top
    length = [float(np.ptp(points, axis=0).max()) for points, _ in drawn]
    assert min(length[:2]) > 2 * max(length[2:])  # the two long walls were seen the least


def one_submap(lines: LineMap) -> RobotMap:
    return RobotMap("a", "boot", 1, (Submap(0, 0, se2.IDENTITY, lines, Trajectory.empty()),))


def test_a_wall_that_is_doubted_pales(rng: Generator, tmp_path: Path) -> None:
    maps = [robot_map(rng, "a"), robot_map(rng, "b")]
    joint = joint_map(maps, true_poses(maps))
    whole = joint.components[0]
    lines = LineMap(whole.map.segments, whole.map.polyline, np.full_like(whole.map.support, 9))
    component = type(whole)(whole.robots, 0.9, lines, whole.segment_confidence)
    draw_joint(JointMap(1, (component,), ()), tmp_path / "joint.svg")
    shades = [darkness(s) for _, s in lines_of(svg(tmp_path / "joint.svg"), "walls-a/0 + b/0")]
    assert shades == sorted(shades)
    assert shades[0] < 0.5 < shades[-1]


def test_each_robot_of_a_team_has_its_colour_in_the_path_and_the_legend(
    rng: Generator, tmp_path: Path
) -> None:
    maps = [robot_map(rng, robot) for robot in "abc"]
    joint = joint_map(maps, true_poses(maps))
    draw_joint(joint, tmp_path / "joint.svg", {m.robot: m for m in maps})
    picture = svg(tmp_path / "joint.svg")
    for robot, colour in zip("abc", ROBOT_COLOURS, strict=False):
        ((_, style),) = lines_of(picture, f"path-{robot}/0-0")
        assert colour in style
        assert f"robot {robot}" in words_of(picture)


def test_paths_of_robots_that_drove_the_same_way_lie_on_each_other(
    rng: Generator, tmp_path: Path
) -> None:
    """Each map is in a frame of its own; the joint map's poses bring them together."""
    maps = [robot_map(rng, "a"), robot_map(rng, "b")]
    draw_joint(
        joint_map(maps, true_poses(maps)), tmp_path / "joint.svg", {m.robot: m for m in maps}
    )
    picture = svg(tmp_path / "joint.svg")
    ((first, _),), ((second, _),) = (lines_of(picture, f"path-{r}/0-0") for r in "ab")
    np.testing.assert_allclose(first, second, atol=0.01)


def test_a_robot_whose_map_is_not_given_is_shown_where_it_starts(
    rng: Generator, tmp_path: Path
) -> None:
    maps = [robot_map(rng, "a"), robot_map(rng, "b")]
    draw_joint(joint_map(maps, true_poses(maps)), tmp_path / "joint.svg", {"a": maps[0]})
    text = (tmp_path / "joint.svg").read_text()
    assert "path-a/0-0" in text
    assert "path-b/0-0" not in text
    assert "start-b/0" in text


def test_components_are_named_with_their_confidence(rng: Generator, tmp_path: Path) -> None:
    maps = [robot_map(rng, "a"), robot_map(rng, "b")]
    joined = joint_map(maps, true_poses(maps)).components[0]
    alone = joint_map([robot_map(rng, "c")], [se2.IDENTITY], 1.0).components[0]
    draw_joint(JointMap(2, (alone, joined), ()), tmp_path / "joint.svg")
    words = words_of(svg(tmp_path / "joint.svg"))
    assert "a/0 + b/0 · confidence 93%" in words
    assert "c/0 |" in words
    assert "Joint map, version 2" in words


def test_a_title_that_is_given_is_written(rng: Generator, tmp_path: Path) -> None:
    draw_map(robot_map(rng), tmp_path / "map.svg", title="Freiburg < 079 & more")
    assert "Freiburg < 079 & more" in words_of(svg(tmp_path / "map.svg"))


@pytest.mark.parametrize("components", [(0, 0, 0), (0, 1, 2)])
def test_a_png_is_1200_pixels_wide_and_of_handy_height(
    components: tuple[int, ...], rng: Generator, tmp_path: Path
) -> None:
    draw_map(robot_map(rng, components=components), tmp_path / "map.png")
    head = (tmp_path / "map.png").read_bytes()[:24]
    assert head.startswith(b"\x89PNG")
    width, height = struct.unpack(">II", head[16:24])
    assert width == 1200
    assert 300 < height < 1600


def test_a_room_is_laid_along_the_edges_however_its_frame_was_turned(rng: Generator) -> None:
    for _ in range(20):
        pose = random_pose(rng)
        room = scene_of(se2.transform_points(pose, rectangle(0, 0, 9, 4)))
        assert -np.pi / 2 < upright(room) <= np.pi / 2
        (placed,) = arrange([room])
        np.testing.assert_allclose(placed.box[1] - placed.box[0], [9, 4], atol=1e-9)
        corners = se2.transform_points(placed.pose, room.map.segments[:, :2])
        np.testing.assert_allclose(corners.min(axis=0), placed.box[0], atol=1e-9)
        np.testing.assert_allclose(corners.max(axis=0), placed.box[1], atol=1e-9)


def test_components_do_not_overlap(rng: Generator) -> None:
    for count in range(1, 12):
        rooms = [
            scene_of(rectangle(0, 0, *rng.uniform(0.5, 20, 2)), f"a/{k}") for k in range(count)
        ]
        boxes = [placed.box for placed in arrange(rooms)]
        assert len(boxes) == count
        for k, box in enumerate(boxes):
            for other in boxes[:k]:
                assert np.any((box[0] > other[1]) | (other[0] > box[1]))


@pytest.mark.parametrize(
    ("most", "length"), [(1.0, 1.0), (4.9, 2.0), (7.0, 5.0), (99.0, 50.0), (0.3, 0.2)]
)
def test_a_scale_bar_is_as_long_as_a_round_length_can_be(most: float, length: float) -> None:
    assert round_length(most) == pytest.approx(length)


def test_a_picture_that_is_neither_svg_nor_png_is_refused(rng: Generator, tmp_path: Path) -> None:
    with pytest.raises(FileError, match=r"map\.jpg: expected .*\.svg or \.png"):
        draw_map(robot_map(rng), tmp_path / "map.jpg")


def test_without_matplotlib_a_picture_asks_for_the_extra(tmp_path: Path) -> None:
    """In a process of its own, in which matplotlib cannot be imported."""
    program = (
        "import sys; sys.modules['matplotlib'] = None\n"
        "from mapweave.maps import RobotMap\n"
        "from mapweave.errors import MissingExtraError\n"
        "from mapweave.pictures.picture import draw_map\n"
        "try: draw_map(RobotMap('a', 'boot', 0, ()), sys.argv[1])\n"
        "except MissingExtraError as error: print(error)\n"
    )
    output = tmp_path / "map.png"
    done = subprocess.run(
        [sys.executable, "-c", program, str(output)], capture_output=True, text=True, check=True
    )
    assert "pip install 'mapweave[plot]'" in done.stdout
    assert not output.exists()
