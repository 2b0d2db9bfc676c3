"""Where each component goes on the sheet: walls upright, components side by side, nothing overlaps.

The components' relative poses are unknown, so each is turned and moved on its own.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray, IntArray
from mapweave.pictures.scene import Scene

GAP = 0.06  # between components, as a share of the widest: clearly apart, little paper wasted
NARROWEST = 0.2  # of the widest: room for the label of a component of a few scans
WIDE = 1.6  # width over height of a sheet of several components, about a screen's
UNIT = np.array([[0.0, 0.0], [1.0, 1.0]])


@dataclass(frozen=True, slots=True, eq=False)
class PlacedScene:
    """A scene on the sheet.

    Attributes
    ----------
    scene
        What is shown.
    pose
        (3,) of the scene's frame on the sheet [m, m, rad].
    box
        (2, 2) lower left and upper right corner of its cell on the sheet [m].
    """

    scene: Scene
    pose: FloatArray
    box: FloatArray


def arrange(scenes: Sequence[Scene]) -> list[PlacedScene]:
    """Return the scenes on one sheet, the largest first, from the top left."""
    turns = [upright(scene) for scene in scenes]
    boxes = [
        bounds(_points(scene) @ se2.rotation(turn).T)
        for scene, turn in zip(scenes, turns, strict=True)
    ]
    sizes = np.array([box[1] - box[0] for box in boxes]).reshape(-1, 2)
    cells = np.maximum(sizes, [NARROWEST * sizes[:, 0].max(initial=0.0), 0.0])
    corners = _shelves(cells)
    return [
        PlacedScene(
            scenes[k],
            np.array([*(corners[k] - boxes[k][0]), turns[k]]),
            np.stack([corners[k], corners[k] + cells[k]]),
        )
        for k in _largest_first(cells)
    ]


def bounds(points: FloatArray) -> FloatArray:
    """Return the (2, 2) lowest and highest corner of (n, 2) `points`; of none, the unit square."""
    return np.stack([points.min(axis=0), points.max(axis=0)]) if len(points) else UNIT


def upright(scene: Scene) -> float:
    """Return the turn [rad] in (-pi/2, pi/2] that lays the scene's walls along the sheet's edges.

    Walls at right angles count as one direction; of the turns that are left, the ones that make
    the scene wider than high are taken, and of these the one nearest to none.
    """
    across = scene.map.segments[:, 2:] - scene.map.segments[:, :2]
    length = np.hypot(*across.T)
    # Four times the angle is the same for all four directions of a rectangle's walls.
    direction = np.angle(np.sum(length * np.exp(4j * np.arctan2(across[:, 1], across[:, 0])))) / 4
    width, height = np.ptp(_points(scene) @ se2.rotation(-direction).T, axis=0)
    turn = -direction if width >= height else np.pi / 2 - direction
    return float(turn - np.pi * np.ceil(turn / np.pi - 0.5))


def _points(scene: Scene) -> FloatArray:
    """Return every (n, 2) point the scene shows, in its frame."""
    origins = [pose[None, :2] for pose in scene.robots.values()]
    return np.concatenate(
        [
            np.empty((0, 2)),
            scene.map.segments.reshape(-1, 2),
            *scene.map.free_space,
            *(polygon for polygons in scene.seen.values() for polygon in polygons),
            *(path.pose[:, :2] for path in scene.paths),
            *(mark.position[None] for mark in scene.marks),
            *origins,
        ]
    )


def _largest_first(cells: FloatArray) -> IntArray:
    return np.argsort(-np.prod(cells, axis=1), kind="stable")


def _shelves(cells: FloatArray) -> FloatArray:
    """Return the (n, 2) lower left corners of (n, 2) `cells`, packed on shelves.

    The largest go first; the sheet grows downwards.
    """
    gap = GAP * cells[:, 0].max(initial=0.0)
    spaced = cells + gap
    limit = max(spaced[:, 0].max(initial=0.0), np.sqrt(WIDE * np.prod(spaced, axis=1).sum()))
    corners = np.zeros_like(cells)
    x = top = shelf = 0.0
    for index in _largest_first(cells):
        if x > 0 and x + spaced[index, 0] > limit * (1 + 1e-9):
            x, top, shelf = 0.0, top - shelf, 0.0
        corners[index] = x, top - cells[index, 1]
        x += spaced[index, 0]
        shelf = max(shelf, spaced[index, 1])
    return corners
