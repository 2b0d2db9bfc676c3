"""A component of a robot's map as it is compared: as a whole, and about places."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import TypeAlias

import numpy as np

from mapweave.geometry.arrays import FloatArray, IntArray
from mapweave.maps import LineMap, RobotMap, Submap, component_name, lines_of
from mapweave.matching.hypotheses import PreparedMap

Preparing: TypeAlias = Callable[[LineMap], PreparedMap | None]


@dataclass(frozen=True, slots=True, eq=False)
class Window:
    """Some submaps of a component together, prepared for comparing, in the component's frame."""

    shape: PreparedMap
    submaps: tuple[Submap, ...]

    @property
    def owner(self) -> IntArray:
        """(n,) of each sample of its raster the place in `submaps` of the one that it is of."""
        counts = [len(s.map.segments) for s in self.submaps]
        owner: IntArray = np.repeat(np.arange(len(counts)), counts)[self.shape.raster.segment]
        return owner


class Component:
    """A component of a robot's map, prepared as a whole and, where it is asked for, about places.

    Parameters
    ----------
    preparing
        Prepares some lines; None where there is too little wall to compare.
    """

    def __init__(self, robot_map: RobotMap, number: int, preparing: Preparing) -> None:
        self.name = component_name(robot_map.robot, number)
        self.submaps = tuple(s for s in robot_map.submaps if s.component == number)
        self._preparing = preparing
        self._windows: dict[tuple[int, ...], Window | None] = {}

    @cached_property
    def whole(self) -> Window | None:
        """All of it; None where there is too little wall to compare."""
        return self._window(tuple(range(len(self.submaps))))

    @property
    def shape(self) -> PreparedMap | None:
        """All of it, as it is compared; None where there is too little wall."""
        return None if self.whole is None else self.whole.shape

    @property
    def size(self) -> float:
        """[m] of wall; 0 where it is too little to compare."""
        return 0.0 if self.whole is None else self.whole.shape.wall

    @cached_property
    def middles(self) -> FloatArray:
        """(n, 2) of the walls of its submaps [m]; infinitely far where there are none."""
        placed = [lines_of([s]).segments.reshape(-1, 2) for s in self.submaps]
        return np.array([e.mean(axis=0) if len(e) else (np.inf, np.inf) for e in placed])

    def about(self, place: FloatArray, radius: float) -> Window | None:
        """Return the submaps whose middles are within `radius` [m] of `place` (2,)."""
        near = np.hypot(*(self.middles - place).T) < radius
        return self._window(tuple(np.flatnonzero(near).tolist()))

    def _window(self, numbers: tuple[int, ...]) -> Window | None:
        if numbers not in self._windows:
            submaps = tuple(self.submaps[k] for k in numbers)
            shape = self._preparing(lines_of(submaps))
            self._windows[numbers] = None if shape is None else Window(shape, submaps)
        return self._windows[numbers]
