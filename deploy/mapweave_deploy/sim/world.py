"""A simulated place: free space, the walls around it, and stops worth visiting."""

from dataclasses import dataclass, field, replace

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from mapweave.geometry.arrays import BoolArray, FloatArray
from mapweave_deploy.sim.effects.terrain import LEVEL, Terrain


def _none() -> FloatArray:
    return np.empty((0, 4))


@dataclass(frozen=True, slots=True, eq=False)
class World:
    """A place robots can drive in; its frame is the one the truth is given in.

    Attributes
    ----------
    name
        Such as ``office``.
    free
        Where no solid is, at the height of the lidar.
    walls
        (n, 4) the faces of everything solid, x1 y1 x2 y2 [m], the visible side on the left.
    dark
        (n,) which faces return little light: glass, black lacquer.
    stops
        (k, 2) places worth visiting [m], in free space.
    glass, mirrors
        (k, 4) faces that most light goes through, and faces that send it on; not among `walls`.
    doors
        (k, 4) leaves of doors where they are shut, from the hinge on [m].
    terrain
        Where the floor is not level.
    """

    name: str
    free: shapely.Polygon
    walls: FloatArray
    dark: BoolArray
    stops: FloatArray
    glass: FloatArray = field(default_factory=_none)
    mirrors: FloatArray = field(default_factory=_none)
    doors: FloatArray = field(default_factory=_none)
    terrain: Terrain = LEVEL


def make_world(name: str, free: BaseGeometry, dark: BaseGeometry, stops: FloatArray) -> World:
    """Return the world of the largest part of `free`; its faces inside `dark` return little."""
    hall = shapely.orient_polygons(largest_polygon(free))
    walls = line_segments(hall.boundary)
    middle = (walls[:, :2] + walls[:, 2:]) / 2
    is_dark = shapely.contains_xy(dark.buffer(0.01), middle[:, 0], middle[:, 1])
    inside = shapely.contains_xy(hall, stops[:, 0], stops[:, 1])
    return World(name, hall, walls, is_dark, stops[inside])


def paned(world: World, glass: BaseGeometry, mirrors: BaseGeometry) -> World:
    """Return `world` with its faces inside `glass` and `mirrors` made of these."""
    middle = (world.walls[:, :2] + world.walls[:, 2:]) / 2
    of_glass, of_mirror = (
        shapely.contains_xy(area.buffer(0.01), middle[:, 0], middle[:, 1])
        for area in (glass, mirrors)
    )
    solid = ~of_glass & ~of_mirror
    return replace(
        world,
        walls=world.walls[solid],
        dark=world.dark[solid],
        glass=world.walls[of_glass],
        mirrors=world.walls[of_mirror],
    )


def largest_polygon(shape: BaseGeometry) -> shapely.Polygon:
    """Return the polygon of largest area in `shape`."""
    parts = [part for part in shapely.get_parts(shape) if isinstance(part, shapely.Polygon)]
    return max(parts, key=lambda part: float(part.area))


def line_segments(lines: BaseGeometry) -> FloatArray:
    """Return the (n, 4) segments of `lines`, each in its line's direction."""
    return np.concatenate(
        [
            np.hstack([corners[:-1], corners[1:]])
            for corners in map(shapely.get_coordinates, shapely.get_parts(lines))
        ]
    )


def box(x: float, y: float, width: float, depth: float, turn: float = 0.0) -> shapely.Polygon:
    """Return a rectangle centred on (`x`, `y`) [m], turned by `turn` [rad]."""
    c, s = np.cos(turn), np.sin(turn)
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * (width / 2, depth / 2)
    return shapely.Polygon(corners @ np.array([[c, s], [-s, c]]) + (x, y))


def disc(x: float, y: float, radius: float) -> shapely.Polygon:
    """Return a round pillar, as a polygon of 12 corners."""
    turns = np.arange(12) * (2 * np.pi / 12)
    return shapely.Polygon(np.column_stack([np.cos(turns), np.sin(turns)]) * radius + (x, y))
