"""The lines of a map as whole numbers, and these as a stream.

Walls of a building run in few directions: in a frame that is turned so that most run along an axis,
one component of a segment is next to nothing. Each segment is given from the end of the one before.
Which polyline comes first means nothing, so they come in an order in which the way between them is
short.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from mapweave.geometry.arrays import FloatArray, IntArray
from mapweave.kernels.range_coder import Coder
from mapweave.maps import LineMap
from mapweave_protocol.wire import packing

PER_METRE = 73  # a step of 13.7 mm: no point moves by more than 9.7 mm
TURNS = 512  # directions of the frame told apart, in a quarter turn
SUPPORTS = (0, 1, 2, 3, 8, 32, 128, 512, 2048, 8192, 65536, 2**31)  # 2 make a wall count in full
CERTAINTIES = 50  # steps of a segment's confidence
MAX_SEGMENTS = 200_000  # of one line map

Segment: TypeAlias = tuple[int, int, int, int]


@dataclass(frozen=True, slots=True, eq=False)
class CodedLines:
    """Lines as whole numbers.

    Attributes
    ----------
    turn
        By how many 512ths of a quarter turn the frame of the numbers is turned.
    segments
        (n, 4) in steps of 1/73 m, polyline by polyline.
    counts
        (m,) how many each polyline has.
    support
        (n,) index in `SUPPORTS`.
    confidence
        (n,) in steps of 0.02; None in robots' maps.
    """

    turn: int
    segments: IntArray
    counts: IntArray
    support: IntArray
    confidence: IntArray | None = None

    @classmethod
    def of(
        cls, lines: LineMap, turn: int, reach: float, confidence: FloatArray | None = None
    ) -> "CodedLines":
        """Return `lines` in the order in which they travel; those without a length vanish.

        Raises
        ------
        ValueError
            If something is not finite, or beyond `reach` [m].
        """
        packing.quantise(lines.segments, 1.0, reach)
        whole = np.rint(turned(lines.segments.reshape(-1, 2), turn) * PER_METRE)
        segments = whole.astype(np.int64).reshape(-1, 4)
        kept = np.flatnonzero(np.any(segments[:, :2] != segments[:, 2:], axis=1))
        starts = np.flatnonzero(np.diff(lines.polyline[kept], prepend=-1))
        runs = np.split(kept, starts[1:]) if len(kept) else []
        runs = [runs[k] for k in _short_way([segments[run] for run in runs])]
        order = np.concatenate([kept[:0], *runs])
        counts = np.array([len(run) for run in runs], dtype=np.int64)
        sure = None
        if confidence is not None:
            sure = packing.quantise(confidence[order], CERTAINTIES, 1.0)
        return cls(turn, segments[order], counts, _classes(lines.support[order]), sure)

    def restore(self) -> tuple[FloatArray, IntArray, IntArray]:
        """Return ``(n, 4)`` segments [m], ``(n,)`` polylines and ``(n,)`` support."""
        points = turned(self.segments.reshape(-1, 2) / PER_METRE, -self.turn)
        polyline = np.repeat(np.arange(len(self.counts)), self.counts)
        return points.reshape(-1, 4), polyline, np.array(SUPPORTS)[self.support]


def turned(points: FloatArray, turn: int) -> FloatArray:
    """Return (n, 2) `points` as they are in a frame turned by `turn` 512ths of a quarter turn."""
    angle = turn * math.pi / (2 * TURNS)
    cosine, sine = math.cos(angle), math.sin(angle)
    return np.asarray(points @ np.array([[cosine, -sine], [sine, cosine]]))


def main_turn(lines: LineMap) -> int:
    """Return the direction in which, or across which, most of the wall runs, in 512ths."""
    along = lines.segments[:, 2:] - lines.segments[:, :2]
    share = np.arctan2(along[:, 1], along[:, 0]) / (np.pi / 2) % 1.0
    wall = np.hypot(along[:, 0], along[:, 1])
    among = np.bincount(np.rint(share * TURNS).astype(int) % TURNS, wall, TURNS)
    near = sum(np.roll(among, step) / (1 + abs(step)) for step in range(-2, 3))
    return int(np.argmax(near))


def code_lines(coder: Coder, lines: CodedLines | None, *, confident: bool) -> CodedLines:
    """Code `lines` with an encoder, or return what a decoder finds.

    Parameters
    ----------
    confident
        Whether segments have a confidence.

    Raises
    ------
    ValueError
        If there are too many.
    """
    turn = coder.count("turn", TURNS - 1, lines.turn if lines else 0)
    polylines = coder.count("polylines", MAX_SEGMENTS, len(lines.counts) if lines else 0)
    given = rows_of(lines) if lines else None
    walk = _Walk(coder, confident=confident)
    counts: list[int] = []
    for number in range(polylines):
        more = int(lines.counts[number]) - 1 if lines else 0
        counts.append(1 + coder.count("segments", MAX_SEGMENTS - len(walk.rows) - 1, more))
        for place in range(counts[-1]):
            walk.step(first=place == 0, row=next(given) if given else None)
    rows = packing.whole_numbers(walk.rows).reshape(-1, 6)
    confidence = rows[:, 5] if confident else None
    return CodedLines(turn, rows[:, :4], packing.whole_numbers(counts), rows[:, 4], confidence)


class _Walk:
    """Goes from segment to segment; the axis along which the last one runs points ahead."""

    def __init__(self, coder: Coder, *, confident: bool) -> None:
        self.rows: list[tuple[int, ...]] = []
        self._coder = coder
        self._confident = confident
        self._end = (0, 0)
        self._quarter = 0
        self._joint = 0  # 0: a polyline begins; 1: ends touch; 2 to 4: apart, ahead or to a side
        self._support = 0

    def step(self, *, first: bool, row: tuple[int, ...] | None) -> None:
        """Code the next segment, its support and its confidence; `first` of its polyline."""
        x1, y1, x2, y2 = row[:4] if row else (0, 0, 0, 0)
        x1, y1 = self._start((x1, y1), first=first)
        x2, y2, size = self._way(x1, y1, (x2, y2), first=first)
        context = "support", self._support, size
        support = self._coder.count(context, len(SUPPORTS) - 1, row[4] if row else 0)
        self._support = support
        confidence = 0
        if self._confident:
            confidence = self._coder.count("confidence", CERTAINTIES, row[5] if row else 0)
        self.rows.append((x1, y1, x2, y2, support, confidence))
        self._end = x2, y2

    def _start(self, start: tuple[int, int], *, first: bool) -> tuple[int, int]:
        """Code where a segment starts."""
        x, y = self._end
        ahead, aside = turned_back(self._quarter, start[0] - x, start[1] - y)
        ahead = self._coder.signed(("ahead", first), ahead)
        aside = self._coder.signed(("aside", first, min(3, abs(ahead).bit_length() // 2)), aside)
        if first:
            self._joint = 0
        else:
            self._joint = 2 + (aside > 0) + 2 * (aside < 0) if ahead or aside else 1
        dx, dy = turned_back(-self._quarter, ahead, aside)
        return x + dx, y + dy

    def _way(self, x: int, y: int, end: tuple[int, int], *, first: bool) -> tuple[int, int, int]:
        """Code where a segment that starts at `x`, `y` ends; return it and the size in bits."""
        dx, dy = end[0] - x, end[1] - y
        self._quarter = code_quarter(self._coder, ("turn", self._joint), self._quarter, dx, dy)
        ahead, aside = turned_back(self._quarter, dx, dy)
        ahead = self._coder.unsigned(("length", first), ahead)
        size = ahead.bit_length()
        aside = self._coder.signed(("across", min(size, 9)), aside)
        dx, dy = turned_back(-self._quarter, ahead, aside)
        return x + dx, y + dy, min(max(size - 3, 0), 4)


def code_quarter(coder: Coder, context: object, before: int, dx: int, dy: int) -> int:
    """Code along which axis, of four, a step points, from that `before`."""
    across = abs(dy) > abs(dx)
    quarter = int(across) + 2 * int((dy if across else dx) < 0)
    change = (quarter - before) % 4
    upper = coder.bit((context, 2), change >> 1)
    return (before + 2 * upper + coder.bit((context, upper), change & 1)) % 4


def turned_back(quarter: int, x: int, y: int) -> tuple[int, int]:
    """Return `x`, `y` in a frame turned by so many quarter turns."""
    return ((x, y), (y, -x), (-x, -y), (-y, x))[quarter % 4]


def rows_of(lines: CodedLines) -> Iterator[tuple[int, ...]]:
    """Yield of each segment its ends, support and confidence, 0 where there is none."""
    confidence = np.zeros_like(lines.support) if lines.confidence is None else lines.confidence
    rows = np.column_stack([lines.segments, lines.support, confidence])
    return (tuple(row) for row in rows.tolist())


def _classes(support: IntArray) -> IntArray:
    """Return (n,) which of `SUPPORTS` is nearest to each, by ratio."""
    middles = np.sqrt(np.array(SUPPORTS[1:-1]) * np.array(SUPPORTS[2:], dtype=float))
    return np.where(support > 0, 1 + np.searchsorted(middles, support), 0)


_TAKEN = 2**40  # farther than any that is left


def _short_way(polylines: list[IntArray]) -> list[int]:
    """Return an order of `polylines`, each (k, 4), in which each starts near the last's end."""
    x, y = np.array([p[0, :2] for p in polylines], dtype=np.int64).reshape(-1, 2).T.copy()
    ends = [p[-1, 2:] for p in polylines]
    order: list[int] = []
    here_x = here_y = 0
    for _ in polylines:
        nearest = int(np.argmin(np.abs(x - here_x) + np.abs(y - here_y)))
        order.append(nearest)
        x[nearest] = _TAKEN
        here_x, here_y = ends[nearest]
    return order
