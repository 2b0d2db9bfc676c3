"""What earlier scans saw through: the space before a beam's return is free."""

from collections import deque
from typing import NamedTuple, Protocol, cast

import numpy as np

from mapweave.kernels.loading import COMPILED
from mapweave.kernels.point_map import Bools, Floats, before_beams


class Viewpoints(Protocol):
    """What both the compiled class and its twin offer."""

    def __len__(self) -> int:
        """Return how many viewpoints there are."""

    def add(self, clear: Floats, first: float, spacing: float, pose: Floats) -> None:
        """Remember a scan; the oldest is forgotten where there are too many.

        Parameters
        ----------
        clear
            (beams,) how far each beam saw nothing [m].
        first, spacing
            [rad] of the first beam, and between beams.
        pose
            (3,) of the sensor [m, m, rad].
        """

    def free(
        self, points: Floats, poses: Floats, asked: Bools, nearest: int, clearance: float
    ) -> Bools:
        """Return (k, n) which points lie where one of the nearest viewpoints saw free space.

        Parameters
        ----------
        points
            (n, 2) [m], in the frame at each of `poses` (k, 3).
        asked
            (k, n) which of them to ask about; False for all others.
        nearest
            How many viewpoints are asked, the nearest to the pose.
        clearance
            [m] how much nearer than what the beam hit a point must be.
        """

    def copy(self) -> "Viewpoints":
        """Return one that grows by itself from here."""


class _Viewpoint(NamedTuple):
    clear: Floats
    first: float
    spacing: float
    pose: Floats


class NumpyViewpoints:
    """The twin of the compiled class."""

    def __init__(self, capacity: int) -> None:
        if capacity < 1:
            raise ValueError("capacity: 1 or more expected")
        self._kept: deque[_Viewpoint] = deque(maxlen=capacity)

    def __len__(self) -> int:
        """See `Viewpoints`."""
        return len(self._kept)

    def add(self, clear: Floats, first: float, spacing: float, pose: Floats) -> None:
        """See `Viewpoints`."""
        if len(clear) < 1 or pose.shape != (3,):
            raise ValueError("clear: a beam or more, pose: (3,) expected")
        self._kept.append(_Viewpoint(clear, first, spacing, pose))

    def free(
        self, points: Floats, poses: Floats, asked: Bools, nearest: int, clearance: float
    ) -> Bools:
        """See `Viewpoints`."""
        shapes = points.shape[1:], poses.shape[1:], asked.shape
        if shapes != ((2,), (3,), (len(poses), len(points))):
            raise ValueError("points (n, 2), poses (k, 3), asked (k, n) expected")
        free = np.zeros(asked.shape, dtype=np.bool_)
        places = np.array([v.pose[:2] for v in self._kept]).reshape(-1, 2)
        for k, pose in enumerate(poses):
            c, s = np.cos(pose[2]), np.sin(pose[2])
            placed = points[asked[k]] @ np.array([[c, s], [-s, c]]) + pose[:2]
            order = np.argsort(np.hypot(*(places - pose[:2]).T), kind="stable")
            for index in order[:nearest].tolist():
                v = self._kept[index]
                free[k, asked[k]] |= before_beams(
                    placed - v.pose[:2], float(v.pose[2]), v.clear, v.first, v.spacing, clearance
                )
        return free

    def copy(self) -> "NumpyViewpoints":
        """See `Viewpoints`."""
        other = NumpyViewpoints(self._kept.maxlen or 1)
        other._kept = self._kept.copy()
        return other


def make_viewpoints(capacity: int) -> Viewpoints:
    """Return an empty memory of at most `capacity` viewpoints."""
    made = NumpyViewpoints if COMPILED is None else COMPILED.Viewpoints
    return cast("Viewpoints", made(capacity))
