"""How many scans saw through each segment after it was seen last."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from mapweave.kernels.arrays import BoolArray, FloatArray, IntArray
from mapweave.kernels.loading import COMPILED

_TURN = 2 * np.pi


@dataclass(frozen=True, slots=True, eq=False)
class _Witness:
    """A scan, how far each of its beams saw, and from where."""

    scan: int
    clear: FloatArray
    first: float
    step: float
    pose: FloatArray


class NumpyWitnesses:
    """Scans that may have seen through segments.

    Parameters
    ----------
    spacing
        [m] between the points asked.
    clearance
        [m] by which seeing through must be certain.
    incidence
        [rad] at which a beam must meet the segment at least.
    share
        Of a segment's points that must be seen through.
    """

    def __init__(self, spacing: float, clearance: float, incidence: float, share: float) -> None:
        if not spacing > 0:
            raise ValueError("spacing: > 0 expected")
        self._spacing = spacing
        self._clearance = clearance
        self._incidence = incidence
        self._share = share
        self._witnesses: list[_Witness] = []

    def __len__(self) -> int:
        return len(self._witnesses)

    def add(
        self, scan: int, clear: FloatArray, first: float, step: float, pose: FloatArray
    ) -> None:
        """Add a witness.

        Parameters
        ----------
        scan
            Its index.
        clear
            (beams,) how far [m] each saw nothing.
        first, step
            [rad] of the first beam, and from beam to beam.
        pose
            (3,) of the sensor [m, m, rad], frame of the segments.
        """
        if len(clear) < 1 or len(pose) != 3:
            raise ValueError("clear: a beam or more, pose: (3,) expected")
        self._witnesses.append(_Witness(scan, clear, first, step, pose))

    def count(self, segments: FloatArray, last_seen: IntArray) -> IntArray:
        """Return (n,) how many scans later than (n,) `last_seen` saw through (n, 4) `segments`."""
        if segments.ndim != 2 or segments.shape[1] != 4 or not np.isfinite(segments).all():
            raise ValueError("segments: finite numbers expected, four a segment")
        if len(last_seen) != len(segments):
            raise ValueError("last_seen: one a segment expected")
        points, owner, along = _samples(segments, self._spacing)
        total = np.bincount(owner, minlength=len(segments))
        counts = np.zeros(len(segments), dtype=np.int64)
        for witness in self._witnesses:
            asked = last_seen[owner] < witness.scan
            if not asked.any():
                continue
            through = self._sees_through(witness, points[asked], along[asked])
            seen = np.bincount(owner[asked], weights=through, minlength=len(segments))
            counts += (seen > 0) & (seen >= self._share * total)
        return counts

    def count_numbered(
        self, numbers: IntArray, segments: FloatArray, last_seen: IntArray
    ) -> IntArray:
        """Return the same; segments of one number, ascending, are the same in every call."""
        if len(numbers) != len(segments) or (np.diff(numbers) <= 0).any():
            raise ValueError("numbers: ascending ones expected, one a segment")
        return self.count(segments, last_seen)

    def _sees_through(self, w: _Witness, points: FloatArray, along: FloatArray) -> BoolArray:
        """(m,) which points a witness sees through, its beams not running along the segment."""
        beam = points - w.pose[:2]
        size = np.hypot(*beam.T)
        across = np.abs(beam[:, 0] * along[:, 1] - beam[:, 1] * along[:, 0])
        steep: BoolArray = across >= np.sin(self._incidence) * size
        cosine, sine = np.cos(w.pose[2]), np.sin(w.pose[2])
        bearing = np.arctan2(
            cosine * beam[:, 1] - sine * beam[:, 0], cosine * beam[:, 0] + sine * beam[:, 1]
        )
        count = len(w.clear)
        steps = np.mod(bearing - w.first, _TURN) / w.step
        closed = count * w.step > _TURN - w.step / 2  # the last beam and the first are neighbours
        number = np.rint(steps).astype(np.int64)
        number[number >= count] = 0
        before: BoolArray = size < w.clear[number] - self._clearance
        inside: BoolArray = (steps <= count - 1) | closed
        through: BoolArray = steep & inside & before
        return through


def _samples(segments: FloatArray, spacing: float) -> tuple[FloatArray, IntArray, FloatArray]:
    """(m, 2) points on the segments, (m,) whose each is, and (m, 2) the direction there."""
    run = segments[:, 2:] - segments[:, :2]
    length = np.hypot(*run.T)
    count = np.ceil(length / spacing).astype(np.int64) + 1
    owner = np.repeat(np.arange(len(segments)), count)
    number = np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count)
    share = (number + 0.5) / count[owner]
    points = segments[owner, :2] + share[:, None] * run[owner]
    return points, owner, (run / np.maximum(length, 1e-12)[:, None])[owner]


if TYPE_CHECKING or COMPILED is None:  # noqa: SIM108 (an alias for types, too)
    Witnesses = NumpyWitnesses
else:
    Witnesses = COMPILED.Witnesses
