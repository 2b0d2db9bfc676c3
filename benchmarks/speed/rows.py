"""Measured times, the figures that are to be reached, and the table of both."""

import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import TypeVar

import numpy as np

from benchmarks.tables import format_table, write_json
from mapweave.geometry.arrays import FloatArray

T = TypeVar("T")

HEAD = ["what", "of", "count", "median ms", "mean ms", "99 % ms"]


@dataclass(frozen=True, slots=True)
class Row:
    """How long one thing takes.

    Attributes
    ----------
    what, of
        What was done, and to what: ``scan, tracked``, ``fr079``.
    count
        How often it was done.
    median, mean, p99
        [ms] of processor time, all threads together.
    """

    what: str
    of: str
    count: int
    median: float
    mean: float
    p99: float

    @classmethod
    def of_seconds(cls, what: str, of: str, seconds: Sequence[float] | FloatArray) -> "Row":
        """Return the row of (n,) measured times [s], one at least."""
        ms = 1000 * np.asarray(seconds, dtype=np.float64)
        median, p99 = np.percentile(ms, [50, 99])
        return cls(what, of, len(ms), float(median), float(ms.mean()), float(p99))


@dataclass(frozen=True, slots=True)
class Growth:
    """How a time grows: as the `exponent`-th power of `by`, from the `least` to the `most`."""

    what: str
    by: str
    least: float
    most: float
    exponent: float


@dataclass(frozen=True, slots=True)
class Figure:
    """A figure that is to be reached.

    Attributes
    ----------
    reached, bound
        What was measured, and what it may be at the most; at the least where `at_least`.
    unit
        ``ms``, ``MB``, or empty for a ratio.
    """

    what: str
    reached: float
    bound: float
    unit: str = ""
    at_least: bool = False

    @property
    def is_met(self) -> bool:
        """Whether it is reached."""
        return self.reached >= self.bound if self.at_least else self.reached <= self.bound


@dataclass(slots=True)
class Report:
    """All that was measured, in the order of measuring; each row is printed when it is known."""

    rows: list[Row] = field(default_factory=list)
    growths: list[Growth] = field(default_factory=list)
    figures: list[Figure] = field(default_factory=list)
    left_out: list[str] = field(default_factory=list)

    def time(self, what: str, of: str, seconds: Sequence[float] | FloatArray) -> Row:
        """Keep the times [s] of one thing, and return their row."""
        row = Row.of_seconds(what, of, seconds)
        self.rows.append(row)
        print(f"{what}, {of}: {row.median:.3f} ms ({row.count} times)")
        return row

    def grow(self, what: str, by: str, sizes: Sequence[float], times: Sequence[float]) -> Growth:
        """Fit the exponent of `times`, of one unit, to the power of `sizes`, and keep it."""
        exponent = float(np.polyfit(np.log(sizes), np.log(times), 1)[0])
        self.growths.append(Growth(what, by, min(sizes), max(sizes), exponent))
        return self.growths[-1]

    def reach(
        self, what: str, reached: float, bound: float, unit: str = "", *, at_least: bool = False
    ) -> None:
        """Keep a figure that is to be reached."""
        self.figures.append(Figure(what, reached, bound, unit, at_least))

    def leave_out(self, what: str, why: str) -> None:
        """Say that something is not measured, and why."""
        self.left_out.append(f"{what} left out: {why}")
        print(self.left_out[-1])

    def write(self, file: Path) -> None:
        """Write all of it as JSON."""
        write_json(file, asdict(self))

    def tell(self) -> str:
        """Return all of it as text: times, growth, figures, and what is left out."""
        grown = [
            [g.what, g.by, f"{g.least:g} to {g.most:g}", f"{g.exponent:.2f}"] for g in self.growths
        ]
        parts = [
            format_table(HEAD, [_cells(row) for row in self.rows]),
            format_table(["growth of", "by", "from", "exponent"], grown),
            format_table(["figure", "measured", "to reach", ""], [*map(_verdict, self.figures)]),
            "\n".join(self.left_out),
        ]
        return "\n\n".join(part for part in parts if part)


def _cells(row: Row) -> list[str]:
    return [
        row.what,
        row.of,
        str(row.count),
        *(f"{t:.3f}" for t in (row.median, row.mean, row.p99)),
    ]


def _verdict(figure: Figure) -> list[str]:
    sign, unit = ("≥" if figure.at_least else "≤"), figure.unit or "x"
    said = "reached" if figure.is_met else "SHORT"
    return [figure.what, f"{figure.reached:.2f} {unit}", f"{sign} {figure.bound:g} {unit}", said]


def timed(work: Callable[[], T]) -> tuple[T, float]:
    """Return what `work` returns, and the processor time it took, all threads together [s]."""
    start = time.process_time()
    result = work()
    return result, time.process_time() - start
