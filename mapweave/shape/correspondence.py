"""Correspondence: which polylines of a scan are which of the map's (paper, V, Correspondence).

Position plays no part: windows of polylines that have the same shape propose rigid motions, and
the pairs of polylines that agree in one are corresponding. Windows are parts of polylines, so a
wall that is seen in part, or has grown since, corresponds all the same. That is one way in which a
scan is found again after a jump; tracking tries it before it searches every motion in a window,
which finds a kidnapped robot without it as well (docs/paper.md).
"""

from dataclasses import dataclass

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from mapweave.geometry.arrays import BoolArray, FloatArray, IntArray
from mapweave.kernels.matching.distinct import agreeing
from mapweave.maps import LineMap
from mapweave.shape.windows import (
    Candidates,
    WindowParameters,
    Windows,
    all_windows,
    has_salient,
    match_all,
)


class CorrespondenceParameters(BaseModel):
    """Which windows agree, and how many different agreements are handed on."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    windows: WindowParameters = WindowParameters()
    distance: float = Field(0.5, gt=0, description="[m] within which motions agree")
    turn: float = Field(0.175, gt=0, description="[rad] within which they agree: 10°")
    count: int = Field(6, ge=1, description="agreements handed on")


@dataclass(frozen=True, slots=True, eq=False)
class Correspondence:
    """Polylines of a scan and of the map that agree in one motion.

    Attributes
    ----------
    transform
        (3,) from the scan's frame to the map's, as the best pair of windows proposes it.
    corresponding
        (map's polylines, scan's polylines) which correspond.
    """

    transform: FloatArray
    corresponding: BoolArray


def correspond(
    known: LineMap, seen: LineMap, parameters: CorrespondenceParameters
) -> list[Correspondence]:
    """Return correspondences of the polylines of `seen` to those of `known`, the best first."""
    if len(known.segments) == 0 or len(seen.segments) == 0:
        return []
    p = parameters.windows
    cut = all_windows(seen.segments, seen.polyline, p)
    b = tuple(windows for windows in cut if has_salient(windows, p))  # the others are like none
    if not b:
        return []
    compared = p.model_copy(update={"lengths": tuple(windows.length for windows in b)})
    a = all_windows(known.segments, known.polyline, compared)
    candidates = match_all(a, b, p)
    if len(candidates) == 0:
        return []
    middle = seen.segments.reshape(-1, 2).mean(axis=0)
    groups = _agreeing(candidates, middle, parameters)
    of_a = _polylines(a, candidates.length, candidates.window_a)
    of_b = _polylines(b, candidates.length, candidates.window_b)
    shape = (int(known.polyline[-1]) + 1, int(seen.polyline[-1]) + 1)
    found = []
    for best, members in groups:
        corresponding = np.zeros(shape, dtype=np.bool_)
        corresponding[of_a[members], of_b[members]] = True
        found.append(Correspondence(candidates.transform[best], corresponding))
    return found


def _agreeing(
    candidates: Candidates, middle: FloatArray, p: CorrespondenceParameters
) -> list[tuple[int, IntArray]]:
    """Groups of candidates that agree with their best one, by the arc length that they explain."""
    x, y, turn = candidates.transform.T
    c, s = np.cos(turn), np.sin(turn)
    place = np.column_stack([c * middle[0] - s * middle[1] + x, s * middle[0] + c * middle[1] + y])
    best, start, members = agreeing(
        place, np.ascontiguousarray(turn), 4 * p.count, p.distance, p.turn
    )
    groups = [
        (float(candidates.score[group].sum()), first, group)
        for first, group in zip(best.tolist(), np.split(members, start[1:-1]), strict=True)
    ]
    groups.sort(key=lambda group: -group[0])
    return [(best, members) for _, best, members in groups[: p.count]]


def _polylines(windows: tuple[Windows, ...], length: FloatArray, window: IntArray) -> IntArray:
    """(p,) the polyline of each candidate's window, which counts within its arc length."""
    polyline = np.empty(len(window), dtype=np.int64)
    for one in windows:
        own = length == one.length
        polyline[own] = one.polyline[window[own]]
    return polyline
