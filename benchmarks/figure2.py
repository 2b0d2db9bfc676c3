"""The paper's figure 2: 400 consecutive scans, their segments, and the map they merge into."""

import argparse
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from benchmarks.coverage import explained_share, returns_at
from benchmarks.logs import find_logs, load_scans
from benchmarks.mapping import merge, segments_of
from benchmarks.runs import map_scans
from benchmarks.tables import OUTPUT, write_json
from benchmarks.truth import paths
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.mapping.mapper import MapperParameters
from mapweave.mapping.tracking.observation import observe
from mapweave.pictures.layout import bounds, upright
from mapweave.pictures.scene import robot_scenes
from mapweave.scan.scan import Scan

PANEL = (4.6, 3.4)  # width and most height of each [in]
ROOM = 0.04  # around a map, as a share of its width
SCALE_BAR = 5.0  # [m]
INK, GREY, FONT = "#16191d", "#6b7280", 9.0


@dataclass(frozen=True, slots=True)
class Simplification:
    """What merging came to.

    Attributes
    ----------
    scans, placed
        Taken, and placed in the largest component.
    segments_in, segments_out
        Of all placed scans, and of the map.
    explained
        Share of the returns under 12 m within 10 cm of the map.
    """

    scans: int
    placed: int
    segments_in: int
    segments_out: int
    explained: float


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Say which scans, and where the picture goes."""
    parser.add_argument("--first", type=int, default=0, metavar="N", help="first scan (0)")
    parser.add_argument("--count", type=int, default=400, metavar="N", help="scans (400)")
    parser.add_argument(
        "--output",
        type=Path,
        default=OUTPUT / "figure2.png",
        help="picture, svg or png (%(default)s)",
    )


def run(options: argparse.Namespace) -> None:
    """Map the scans, print the figures, draw both panels."""
    for log in find_logs(["fr079-dense"]):
        scans = load_scans(log)[options.first : options.first + options.count]
        before, after, figures = _simplify(scans)
        write_json(options.output.with_suffix(".json"), asdict(figures))
        _draw(before, after, figures).savefig(options.output)
        print(tell(figures))
        print(f"Drawn as {options.output}")


def tell(f: Simplification) -> str:
    """Return the figures as a sentence."""
    return (
        f"{f.placed} of {f.scans} consecutive scans of fr079-dense: {f.segments_in:,} scan segments"
        f" went in, {f.segments_out:,} map segments came out; {f.explained:.1%} of the returns"
        " under 12 m lie within 10 cm of them."
    )


def _simplify(scans: Sequence[Scan]) -> tuple[FloatArray, FloatArray, Simplification]:
    """Return the segments of the scans where they were placed and of the map, walls upright."""
    robot_map = map_scans("fr079-dense", scans).robot_map
    path = paths(robot_map)[0]
    placed = [scans[k - scans[0].index] for k in path.index]
    before = _placed_segments(placed, path.pose)
    after = segments_of(merge(robot_map), path.component)
    explained = explained_share(returns_at(placed, path.pose), after)
    figures = Simplification(len(scans), len(placed), len(before), len(after), explained)
    scene = next(
        s for s in robot_scenes(robot_map) if f"{robot_map.robot}/{path.component}" in s.robots
    )
    turn = np.array([0.0, 0.0, upright(scene)])
    return se2.transform_segments(turn, before), se2.transform_segments(turn, after), figures


def _placed_segments(scans: Sequence[Scan], poses: FloatArray) -> FloatArray:
    parameters = MapperParameters().observation
    return np.concatenate(
        [
            se2.transform_segments(pose, observe(scan, parameters).lines.segments)
            for scan, pose in zip(scans, poses, strict=True)
        ]
    )


def _draw(before: FloatArray, after: FloatArray, figures: Simplification) -> Figure:
    low, high = bounds(before.reshape(-1, 2))
    margin = ROOM * (high[0] - low[0])
    low, high = low - margin, high + margin
    width, most = PANEL
    scale = min(width / (high[0] - low[0]), most / (high[1] - low[1]))  # [in/m]
    height = scale * (high[1] - low[1]) + 0.35
    figure = Figure(figsize=(2 * width, height), dpi=150, facecolor="white")
    titles = (
        f"{figures.segments_in:,} segments of {figures.placed} scans",
        f"{figures.segments_out:,} segments of the map",
    )
    for k, (segments, title) in enumerate(zip((before, after), titles, strict=True)):
        axes = figure.add_axes((k / 2, 0.0, 0.5, 1 - 0.35 / height))
        axes.set_xlim(low[0], high[0])
        axes.set_ylim(low[1], high[1])
        _draw_segments(axes, segments, width=(0.25, 0.9)[k])
        axes.set_title(title, fontsize=FONT, color=INK)
    _draw_scale(axes, low + 1.2 * margin, SCALE_BAR)
    return figure


def _draw_segments(axes: Axes, segments: FloatArray, width: float) -> None:
    axes.add_collection(
        LineCollection(list(segments.reshape(-1, 2, 2)), colors=INK, linewidths=width)
    )
    axes.set_aspect("equal")
    axes.set_axis_off()


def _draw_scale(axes: Axes, corner: FloatArray, length: float) -> None:
    """Draw a bar of `length` [m] at the lower left `corner`."""
    x, y = corner
    axes.plot([x, x + length], [y, y], color=GREY, linewidth=1.5)
    axes.annotate(
        f"{length:g} m", (x, y), (0, 3), textcoords="offset points", color=GREY, fontsize=FONT
    )
