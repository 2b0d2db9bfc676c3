"""A figure around the drawn scenes: headline, scale bar, legend; needs matplotlib.

There are no axes: nobody reads coordinates off a floor plan, and the scale bar tells size.
`mapweave.pictures.picture` is the way in.
"""

import math
import textwrap
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from mapweave.geometry.arrays import FloatArray
from mapweave.pictures.drawing import (
    FLOOR,
    INK,
    WALL_WIDTH,
    WEAK_WALL,
    Style,
    choose_style,
    draw_scene,
)
from mapweave.pictures.layout import UNIT, PlacedScene, arrange
from mapweave.pictures.scene import Scene, tell_confidence

WIDTH = 8.0  # of the figure [in]; 1200 pixels at DPI
DPI = 150
MARGIN = 0.3  # left and right [in]
HEAD = 0.8  # above the map [in]
NAMES = 0.2  # above it as well, where components are named [in]
GAP = 0.15  # between the map and what is beneath [in]
MAP_HEIGHT = (1.5, 8.0)  # least and most [in]
ROW = 0.21  # of the legend [in]
HANDLE = 0.5  # a legend entry without its words [in]
SCALE_BAR = 1.4  # at most [in]
FONT = 8.0  # [pt]
CHARACTER = 0.55 * FONT / 72  # mean width of one [in]
GREY = "#6b7280"


@dataclass(frozen=True, slots=True, eq=False)
class Sheet:
    """What goes where, in inches from the lower left.

    Attributes
    ----------
    scale
        [in/m].
    centre
        (2,) of the map [m].
    head, map_height, foot
        Of what is above the map, of the map and of what is beneath it [in].
    """

    scale: float
    centre: FloatArray
    head: float
    map_height: float
    foot: float

    @property
    def height(self) -> float:
        """Of the whole figure [in]."""
        return self.head + self.map_height + self.foot


def draw(scenes: Sequence[Scene], title: str, subtitle: str) -> Figure:
    """Return a figure of `scenes`, side by side, all at one scale."""
    placed, style = arrange(scenes), choose_style(scenes)
    legend = _legend_rows(scenes, style)
    sheet = _plan(placed, sum(_lines(row) for row in legend))
    figure = Figure(figsize=(WIDTH, sheet.height), dpi=DPI, facecolor="white")
    axes = _map_axes(figure, sheet)
    for each in placed:
        draw_scene(axes, each, style)
        if len(placed) > 1:
            _label(axes, each, sheet.scale)
    _write_head(figure, title, subtitle)
    _draw_scale_bar(figure, sheet)
    _draw_legend(figure, legend)
    return figure


def save(figure: Figure, path: Path, kind: str) -> None:
    """Write `figure` as `kind`, ``svg`` or ``png``: the same bytes for the same figure."""
    # matplotlib would sign with its version and the date, and name svg parts at random.
    metadata = {"svg": {"Date": None, "Creator": None}, "png": {"Software": None}}[kind]
    with (
        rc_context({"svg.hashsalt": "mapweave", "svg.fonttype": "none"}),
        warnings.catch_warnings(),
    ):
        # A label in letters that no font here has: a picture shows boxes, and all else is right.
        warnings.filterwarnings("ignore", r"Glyph \d+ .* missing from", UserWarning)
        figure.savefig(path, format=kind, metadata=metadata)


def round_length(most: float) -> float:
    """Return the greatest of …, 0.5, 1, 2, 5, 10, 20, … up to `most`."""
    decade = 10.0 ** np.floor(np.log10(most))
    return float(decade * max(step for step in (1, 2, 5) if step * decade <= most))


def _plan(placed: Sequence[PlacedScene], legend_rows: int) -> Sheet:
    boxes = np.stack([each.box for each in placed]) if placed else UNIT[None]
    low, high = boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)
    width, height = np.maximum(high - low, 1.0)
    scale = min((WIDTH - 2 * MARGIN) / width, MAP_HEIGHT[1] / height)
    map_height = max(MAP_HEIGHT[0], scale * height)
    head = HEAD + (NAMES if len(placed) > 1 else 0.0)
    return Sheet(scale, (low + high) / 2, head, map_height, 2 * GAP + (legend_rows + 0.5) * ROW)


def _map_axes(figure: Figure, sheet: Sheet) -> Axes:
    """Return axes [m] over the figure's whole width; both axes have the sheet's scale."""
    axes = figure.add_axes((0.0, sheet.foot / sheet.height, 1.0, sheet.map_height / sheet.height))
    half = np.array([WIDTH, sheet.map_height]) / sheet.scale / 2
    low, high = sheet.centre - half, sheet.centre + half
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
    axes.set_aspect("equal")
    axes.set_axis_off()
    return axes


def _label(axes: Axes, placed: PlacedScene, scale: float) -> None:
    """Write the component's name and confidence above its upper left corner."""
    (left, _), (right, top) = placed.box
    text = " · ".join([placed.scene.name, *tell_confidence(placed.scene)])
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


def _write_head(figure: Figure, title: str, subtitle: str) -> None:
    left, inch = MARGIN / WIDTH, 1 / figure.get_figheight()
    figure.text(left, 1 - 0.2 * inch, title, size=12, weight="bold", color=INK, va="top")
    figure.text(left, 1 - 0.45 * inch, subtitle, size=FONT, color=GREY, va="top")


def _draw_scale_bar(figure: Figure, sheet: Sheet) -> None:
    length = round_length(SCALE_BAR / sheet.scale)
    left, right = MARGIN / WIDTH, (MARGIN + length * sheet.scale) / WIDTH
    middle, tick = (GAP + ROW / 2) / sheet.height, 0.04 / sheet.height
    ends = [middle - tick, middle + tick, middle]
    bar = Line2D([left] * 3 + [right] * 3, ends + ends[::-1], color=INK, linewidth=1.0)
    bar.set_gid("scale-bar")
    figure.add_artist(bar)
    figure.text(
        (left + right) / 2, middle + 2 * tick, f"{length:g} m", size=FONT, color=INK, ha="center"
    )


def _legend_rows(scenes: Sequence[Scene], style: Style) -> list[list[Artist]]:
    """Return what the lines mean, and for a team, in rows of its own, whose colour is whose."""
    robots = [
        _line(f"robot {robot}" if style.team else "path from its start", colour, 1.2, marker=">")
        for robot, colour in style.colours.items()
    ]
    kinds: list[Artist] = [
        _line(f"wall seen by {style.strong}+ scans", INK, WALL_WIDTH[1]),
        _line("by one", WEAK_WALL, WALL_WIDTH[0]),
    ]
    if any(scene.map.free_space for scene in scenes):
        tinted = style.team and any(scene.seen for scene in scenes)
        floor = "free space, tinted by who saw it" if tinted else "free space"
        kinds.append(Patch(facecolor=FLOOR, edgecolor="#cfd5dc", linewidth=0.4, label=floor))
    return [kinds, [*robots]] if style.team else [[*kinds, *robots]]


def _line(label: str, colour: str, width: float, marker: str = "none") -> Line2D:
    return Line2D([], [], color=colour, linewidth=width, marker=marker, markersize=5, label=label)


def _columns(row: Sequence[Artist]) -> int:
    """Return how many entries fit next to the scale bar: all, or else as if all were the widest."""
    room = WIDTH - 2 * MARGIN - SCALE_BAR
    widths = [HANDLE + CHARACTER * len(str(entry.get_label())) for entry in row]
    return len(row) if sum(widths) <= room else max(1, int(room / max(widths)))


def _lines(row: Sequence[Artist]) -> int:
    """Return in how many lines the entries go."""
    return math.ceil(len(row) / _columns(row)) if row else 0


def _draw_legend(figure: Figure, rows: Sequence[Sequence[Artist]]) -> None:
    bottom = GAP / figure.get_figheight()
    for row in reversed(rows):
        figure.legend(
            handles=list(row),
            loc="lower right",
            bbox_to_anchor=(1 - MARGIN / WIDTH, bottom),
            borderaxespad=0.0,
            borderpad=0.0,
            ncols=_columns(row),
            frameon=False,
            fontsize=FONT,
            labelcolor=INK,
            handlelength=1.8,
            columnspacing=1.6,
        )
        bottom += ROW * _lines(row) / figure.get_figheight()
