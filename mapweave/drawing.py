"""Draws scenes as a figure; `mapweave.picture` is the way in, as this needs matplotlib.

Beneath lies the free space, over it the walls, dark and strong where many scans saw them, and on
top the paths. There are no axes: nobody reads coordinates off a floor plan; a scale bar tells size.
"""

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import shapely
from matplotlib import rc_context
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, PathPatch
from matplotlib.path import Path as Outline

from mapweave import se2
from mapweave.arrays import FloatArray, IntArray
from mapweave.layout import UNIT, Placed, arrange
from mapweave.scene import Scene, place_map, robot_of

WIDTH = 8.0  # of the figure [in]; 1200 pixels at DPI
DPI = 150
MARGIN = 0.3  # [in]
TITLE_HEIGHT = 0.55  # [in]
LEGEND_ROW = 0.22  # [in]
MAP_HEIGHT = (1.5, 8.0)  # least and most [in]
SCALE_BAR = 1.4  # at most [in]
LEGEND_COLUMNS = 4
NAME_ROOM = 0.05  # above a component, as a share of the sheet's width
FONT = 8.0  # [pt]
CHARACTER = 0.55 * FONT / 72  # mean width of one [in]

# Okabe and Ito's palette, the pale ones left out: told apart by the colour-blind as well.
ROBOT_COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#7f4f24")
INK, GREY, FLOOR = "#16191d", "#6b7280", "#eceff3"
WALLS = LinearSegmentedColormap.from_list("walls", ["#aab2bd", INK])
WALL_WIDTH = (0.5, 1.7)  # seen by one scan, and by many [pt]
STRONG = 75  # percentile of the support from which on a wall is drawn in full strength


@dataclass(frozen=True, slots=True)
class Style:
    """What is chosen once for the whole figure.

    Attributes
    ----------
    colours
        By robot id.
    strong
        The support [scans] from which on a wall is drawn in full strength.
    """

    colours: dict[str, str]
    strong: int


def draw(scenes: Sequence[Scene], title: str, subtitle: str) -> Figure:
    """Return a figure of `scenes`, side by side, all at one scale."""
    placed = arrange(scenes)
    style = _style(scenes)
    entries = _legend_entries(scenes, style)
    footer = MARGIN / 2 + LEGEND_ROW * -(-len(entries) // LEGEND_COLUMNS) + LEGEND_ROW / 2
    low, high = _extent(placed, named=len(scenes) > 1)
    scale = min((WIDTH - 2 * MARGIN) / (high[0] - low[0]), MAP_HEIGHT[1] / (high[1] - low[1]))
    height = max(MAP_HEIGHT[0], scale * (high[1] - low[1]))
    total = TITLE_HEIGHT + height + 2 * MARGIN + footer
    figure = Figure(figsize=(WIDTH, total), dpi=DPI, facecolor="white")
    axes = _map_axes(figure, (footer + MARGIN) / total, height / total, (low + high) / 2, scale)
    for each in placed:
        _draw_scene(axes, each, style)
        if len(placed) > 1:
            _label(axes, each, scale)
    _write_title(figure, title, subtitle)
    _draw_scale_bar(figure, footer / total, scale)
    _draw_legend(figure, entries)
    return figure


def _style(scenes: Sequence[Scene]) -> Style:
    robots = sorted({robot_of(name) for scene in scenes for name in scene.robots})
    colours = {
        robot: ROBOT_COLOURS[place % len(ROBOT_COLOURS)] for place, robot in enumerate(robots)
    }
    support = np.concatenate([[2], *(scene.map.support for scene in scenes)])
    return Style(colours, max(2, round(float(np.percentile(support, STRONG)))))


def _extent(placed: Sequence[Placed], named: bool) -> FloatArray:
    """Return the (2, 2) corners of the sheet [m], never without area; names need room on top."""
    if not placed:
        return UNIT
    boxes = np.stack([each.box for each in placed])
    low, high = boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)
    high = np.maximum(high, low + 1.0)
    high[1] += NAME_ROOM * (high[0] - low[0]) * named
    return np.stack([low, high])


def _map_axes(
    figure: Figure, bottom: float, height: float, centre: FloatArray, scale: float
) -> Axes:
    """Return axes over the figure's whole width, at `scale` [in/m], `centre` [m] in the middle."""
    axes = figure.add_axes((0.0, bottom, 1.0, height))
    half = np.array([WIDTH, height * figure.get_figheight()]) / scale / 2
    axes.set_xlim(centre[0] - half[0], centre[0] + half[0])
    axes.set_ylim(centre[1] - half[1], centre[1] + half[1])
    axes.set_aspect("equal")
    axes.set_axis_off()
    return axes


def _draw_scene(axes: Axes, placed: Placed, style: Style) -> None:
    scene = placed.scene
    lines = place_map(placed.pose, scene.map)
    _draw_floor(axes, lines.free_space, FLOOR, alpha=1.0)
    if len(style.colours) > 1:
        for name, polygons in scene.seen.items():
            own = [se2.transform_points(placed.pose, polygon) for polygon in polygons]
            _draw_floor(axes, own, style.colours[robot_of(name)], alpha=0.13)
    _draw_walls(axes, lines.segments, lines.support, style.strong)
    for path in scene.paths:
        poses = se2.compose(placed.pose, path.pose)
        axes.plot(
            *poses[:, :2].T,
            color=style.colours[path.robot],
            linewidth=0.8,
            alpha=0.9,
            zorder=4,
            gid=f"path-{path.component}",
        )
    for name, start in _starts(scene).items():
        _draw_start(axes, se2.compose(placed.pose, start), style.colours[robot_of(name)])


def _draw_floor(axes: Axes, polygons: Sequence[FloatArray], colour: str, alpha: float) -> None:
    """Fill the union of `polygons`: overlaps must not show."""
    union = shapely.union_all([shapely.make_valid(shapely.Polygon(each)) for each in polygons])
    rings = [
        Outline(np.asarray(ring.coords), closed=True)
        for part in shapely.get_parts(union)
        if isinstance(part, shapely.Polygon)
        for ring in (part.exterior, *part.interiors)
    ]
    if rings:
        outline = Outline.make_compound_path(*rings)
        axes.add_patch(
            PathPatch(outline, facecolor=colour, edgecolor="none", alpha=alpha, zorder=1)
        )


def _draw_walls(axes: Axes, segments: FloatArray, support: IntArray, strong: int) -> None:
    order = np.argsort(support, kind="stable")  # the well-seen on top
    strength = _strength(support[order], strong)
    walls = LineCollection(
        list(segments[order].reshape(-1, 2, 2)),
        colors=WALLS(strength),
        linewidths=WALL_WIDTH[0] + (WALL_WIDTH[1] - WALL_WIDTH[0]) * strength,
        capstyle="round",
        zorder=3,
        gid="walls",
    )
    axes.add_collection(walls, autolim=False)


def _strength(support: IntArray, strong: int) -> FloatArray:
    """Return (n,) in [0, 1]: logarithmic, as a second sighting tells more than a hundredth."""
    return np.clip(np.log(np.maximum(support, 1)) / np.log(strong), 0.0, 1.0)


def _starts(scene: Scene) -> dict[str, FloatArray]:
    """Return where each robot's component starts: its first scan, or else its origin."""
    starts = dict(scene.robots)
    for path in reversed(scene.paths):
        starts[path.component] = path.pose[0]
    return starts


def _draw_start(axes: Axes, pose: FloatArray, colour: str) -> None:
    axes.plot(
        *pose[:2],
        marker=(3, 0, np.degrees(pose[2]) - 90),
        markersize=7.5,
        linestyle="none",
        color=colour,
        markeredgecolor="white",
        markeredgewidth=0.8,
        zorder=5,
    )


def _label(axes: Axes, placed: Placed, scale: float) -> None:
    """Write the component's name and confidence above its upper left corner."""
    (left, _), (right, top) = placed.box
    confidence = placed.scene.confidence
    text = placed.scene.name + ("" if confidence is None else f" · confidence {confidence:.0%}")
    columns = max(8, int((right - left) * scale / CHARACTER))
    axes.text(
        left,
        top + 0.05 / scale,
        textwrap.fill(text, columns),
        fontsize=FONT,
        color=INK,
        verticalalignment="bottom",
        zorder=6,
    )


def _write_title(figure: Figure, title: str, subtitle: str) -> None:
    height, left = figure.get_figheight(), MARGIN / WIDTH
    figure.text(
        left,
        1 - 0.22 / height,
        title,
        fontsize=12,
        fontweight="bold",
        color=INK,
        verticalalignment="top",
    )
    figure.text(
        left, 1 - 0.47 / height, subtitle, fontsize=FONT, color=GREY, verticalalignment="top"
    )


def _draw_scale_bar(figure: Figure, bottom: float, scale: float) -> None:
    """Draw a round length [m] under the lower left of the map, which is at `scale` [in/m]."""
    length = round_length(SCALE_BAR / scale)
    left = MARGIN / WIDTH
    right = left + length * scale / WIDTH
    tick = 0.04 / figure.get_figheight()
    middle = bottom - LEGEND_ROW / figure.get_figheight()
    figure.add_artist(
        Line2D(
            [left, left, left, right, right, right],
            [middle - tick, middle + tick, middle, middle, middle + tick, middle - tick],
            color=INK,
            linewidth=1.0,
            gid="scale-bar",
        )
    )
    figure.text(
        (left + right) / 2,
        middle + 2 * tick,
        f"{length:g} m",
        fontsize=FONT,
        color=INK,
        horizontalalignment="center",
        verticalalignment="bottom",
    )


def round_length(most: float) -> float:
    """Return the greatest of 1, 2, 5, 10, 20, 50, … (and of 0.5, 0.2, …) [m] up to `most`."""
    decade = 10.0 ** np.floor(np.log10(most))
    return float(decade * max(step for step in (1, 2, 5) if step * decade <= most))


def _legend_entries(scenes: Sequence[Scene], style: Style) -> list[Artist]:
    many, team = style.strong, len(style.colours) > 1
    entries: list[Artist] = [
        Line2D([], [], color=WALLS(1.0), linewidth=WALL_WIDTH[1], label=f"wall, {many}+ scans"),
        Line2D([], [], color=WALLS(0.0), linewidth=WALL_WIDTH[0], label="wall, 1 scan"),
    ]
    if any(scene.map.free_space for scene in scenes):
        entries.append(
            Patch(facecolor=FLOOR, edgecolor="#cfd5dc", linewidth=0.4, label="free space")
        )
    for robot, colour in style.colours.items():
        entries.append(
            Line2D(
                [],
                [],
                color=colour,
                linewidth=1.2,
                marker=">",
                markersize=5,
                markevery=[0],
                label=f"robot {robot}" if team else "path from its start",
            )
        )
    return entries


def _draw_legend(figure: Figure, entries: Sequence[Artist]) -> None:
    figure.legend(
        handles=list(entries),
        loc="lower right",
        bbox_to_anchor=(1 - 0.6 * MARGIN / WIDTH, 0.5 * MARGIN / figure.get_figheight()),
        borderaxespad=0.0,
        ncols=min(LEGEND_COLUMNS, len(entries)),
        frameon=False,
        fontsize=FONT,
        labelcolor=INK,
        handlelength=1.8,
        columnspacing=1.6,
    )


def save(figure: Figure, path: Path, kind: str) -> None:
    """Write `figure` as `kind`, ``svg`` or ``png``: the same bytes for the same figure."""
    # matplotlib would sign with its version and the date, and name svg parts at random.
    metadata = {"svg": {"Date": None, "Creator": None}, "png": {"Software": None}}[kind]
    with rc_context({"svg.hashsalt": "mapweave", "svg.fonttype": "none"}):
        figure.savefig(path, format=kind, metadata=metadata)
