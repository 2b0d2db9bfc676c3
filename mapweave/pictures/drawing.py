"""Draws scenes into axes, in metres; needs matplotlib.

Beneath lies the free space, over it the walls, dark and strong where many scans saw them, and on
top the paths and the marks.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.patches import PathPatch
from matplotlib.path import Path as Outline

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.pictures.layout import PlacedScene
from mapweave.pictures.scene import Scene, robot_of
from mapweave.scan.free_space import from_rings

# Okabe and Ito's palette, the pale ones left out: told apart by the colour-blind as well.
ROBOT_COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#7f4f24")
INK, WEAK_WALL, FLOOR = "#16191d", "#b4bcc6", "#eceff3"
WALLS = LinearSegmentedColormap.from_list("walls", [WEAK_WALL, INK])
WALL_WIDTH = (0.4, 1.3)  # seen by one scan, and by many [pt]
STRONG = 85  # percentile of the support from which on a wall is drawn in full strength
TINT = 0.13  # opacity of the floor a robot saw
MARK, MARK_FONT = "#b0003a", 7.5  # colour, size [pt]
GLIMPSE = 0.1  # [m] half the width of a glimpse through a gap; narrower ones only streak the floor


@dataclass(frozen=True, slots=True)
class Style:
    """What is chosen once for the whole picture.

    Attributes
    ----------
    colours
        By robot id.
    strong
        The support [scans] from which on a wall is drawn in full strength.
    """

    colours: Mapping[str, str]
    strong: int

    @property
    def team(self) -> bool:
        """Whether there are several robots to tell apart."""
        return len(self.colours) > 1


def choose_style(scenes: Sequence[Scene]) -> Style:
    """Return a colour for each robot, by the order of their names, and the scale of support."""
    robots = sorted({robot_of(name) for scene in scenes for name in scene.robots})
    colours = {
        robot: ROBOT_COLOURS[place % len(ROBOT_COLOURS)] for place, robot in enumerate(robots)
    }
    support = np.concatenate([[2], *(scene.map.support for scene in scenes)])
    return Style(colours, max(2, round(float(np.percentile(support, STRONG)))))


def draw_scene(axes: Axes, placed: PlacedScene, style: Style) -> None:
    """Draw a scene where it is placed."""
    _draw_floors(axes, placed, style)
    _draw_walls(axes, placed, style.strong)
    _draw_paths(axes, placed, style)
    _draw_marks(axes, placed)


def _draw_floors(axes: Axes, placed: PlacedScene, style: Style) -> None:
    scene = placed.scene
    _draw_floor(axes, _floor(placed.pose, scene.map.free_space), FLOOR, 1.0, f"floor-{scene.name}")
    if style.team:
        for name, polygons in scene.seen.items():
            seen = _floor(placed.pose, polygons)
            _draw_floor(axes, seen, style.colours[robot_of(name)], TINT, f"seen-{name}")


def _floor(pose: FloatArray, polygons: Sequence[FloatArray]) -> list[Outline]:
    """Return the outlines of the union of `polygons`, in the frame at `pose`: none overlap."""
    union = from_rings(se2.transform_points(pose, polygon) for polygon in polygons)
    floor = union.buffer(-GLIMPSE, quad_segs=4).buffer(GLIMPSE, quad_segs=4)
    return [
        Outline(np.asarray(ring.coords), closed=True)
        for part in shapely.get_parts(floor)
        for ring in (part.exterior, *part.interiors)
    ]


def _draw_floor(
    axes: Axes, outlines: Sequence[Outline], colour: str, opacity: float, name: str
) -> None:
    if outlines:
        whole = Outline.make_compound_path(*outlines)
        floor = PathPatch(whole, facecolor=colour, edgecolor="none", alpha=opacity, zorder=1)
        floor.set_gid(name)
        axes.add_patch(floor)


def _draw_walls(axes: Axes, placed: PlacedScene, strong: int) -> None:
    lines = placed.scene.map.moved(placed.pose)
    strength = _strength(placed.scene, strong)
    order = np.argsort(strength, kind="stable")  # the well-seen on top
    walls = LineCollection(
        list(lines.segments[order].reshape(-1, 2, 2)),
        colors=WALLS(strength[order]),
        linewidths=WALL_WIDTH[0] + (WALL_WIDTH[1] - WALL_WIDTH[0]) * strength[order],
        capstyle="projecting",
        zorder=3,
        gid=f"walls-{placed.scene.name}",
    )
    axes.add_collection(walls, autolim=False)


def _strength(scene: Scene, strong: int) -> FloatArray:
    """Return (n,) in [0, 1] how strongly to draw each wall.

    Logarithmic in the support, as a second sighting tells more than a hundredth. In a joint map a
    wall that another robot saw through pales with its confidence.
    """
    seen = np.clip(np.log(np.maximum(scene.map.support, 1)) / np.log(strong), 0.0, 1.0)
    return np.asarray(seen if scene.segment_confidence is None else seen * scene.segment_confidence)


def _draw_paths(axes: Axes, placed: PlacedScene, style: Style) -> None:
    scene = placed.scene
    for path in scene.paths:
        x, y = se2.compose(placed.pose, path.pose)[:, :2].T
        colour = style.colours[path.robot]
        name = f"path-{path.component}-{path.scan_index[0]}"
        axes.plot(x, y, color=colour, linewidth=0.8, alpha=0.9, zorder=4, gid=name)
    for name, start in _starts(scene).items():
        pose = se2.compose(placed.pose, start)
        _draw_start(axes, pose, style.colours[robot_of(name)], f"start-{name}")


def _starts(scene: Scene) -> dict[str, FloatArray]:
    """Return where each robot's component starts: its first scan, or else its origin."""
    starts = dict(scene.robots)
    for path in reversed(scene.paths):
        starts[path.component] = path.pose[0]
    return starts


def _draw_start(axes: Axes, pose: FloatArray, colour: str, name: str) -> None:
    """Draw an arrowhead at `pose`, in the direction the robot looked."""
    axes.plot(
        pose[0],
        pose[1],
        marker=(3, 0, float(np.degrees(pose[2])) - 90),
        markersize=7.5,
        linestyle="none",
        color=colour,
        markeredgecolor="white",
        markeredgewidth=0.8,
        zorder=5,
        gid=name,
    )


def _draw_marks(axes: Axes, placed: PlacedScene) -> None:
    """Draw a cross in a ring at each mark, and its label beside it."""
    for mark in placed.scene.marks:
        x, y = se2.transform_points(placed.pose, mark.position).tolist()
        axes.plot(
            x,
            y,
            marker="X",
            markersize=7.0,
            linestyle="none",
            color=MARK,
            markeredgecolor="white",
            markeredgewidth=0.8,
            zorder=7,
            gid=f"mark-{mark.id}",
        )
        axes.annotate(
            mark.label,
            (x, y),
            xytext=(5.0, 3.0),
            textcoords="offset points",
            fontsize=MARK_FONT,
            fontweight="bold",
            color=MARK,
            bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 0.8},
            parse_math=False,
            zorder=7,
        )
