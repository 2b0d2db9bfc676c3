"""Compares maps in a process of its own, so that mapping is never held up by it.

A thread would not do: hypothesis and verification are many small numpy operations, which hold
Python's lock most of the time.
"""

import time
import traceback
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from multiprocessing.connection import Connection
from typing import TypeAlias

from mapweave.maps import Alignment, RobotMap
from mapweave_agent.comparison_schedule import Comparison
from mapweave_agent.worker import LAST, Worker, answer
from mapweave_protocol.wire.pairs import told_apart

Aligner: TypeAlias = Callable[[RobotMap, RobotMap], Sequence[Alignment]]


@dataclass(frozen=True, slots=True)
class ComparisonOutcome:
    """What came of a comparison.

    Attributes
    ----------
    alignments
        One for each pair of components; None if it failed.
    took
        [s]
    failure
        What went wrong, empty if nothing did.
    """

    comparison: Comparison
    alignments: tuple[Alignment, ...] | None
    took: float
    failure: str = ""


class ComparisonWorker(Worker):
    """Does one comparison at a time; a context manager that ends its process.

    Parameters
    ----------
    align
        Aligns all pairs of components of two maps; a function at the top of a module, or a
        `functools.partial` of one.
    """

    def __init__(self, align: Aligner) -> None:
        super().__init__(_serve, align)
        self._comparison: Comparison | None = None
        self._started = 0.0

    @property
    def busy(self) -> bool:
        """Whether a comparison was started and its outcome not yet taken."""
        return self._comparison is not None

    def start(self, comparison: Comparison) -> None:
        """Start `comparison`; the one before must have been taken."""
        self._comparison = comparison
        self._started = time.monotonic()
        try:
            self._pipe.send(told_apart(comparison.reference, comparison.other))
        except (BrokenPipeError, ConnectionResetError):
            # The process died while it waited; `take` starts another and reports it.
            return

    def take(self) -> ComparisonOutcome | None:
        """Return the outcome when there is one."""
        comparison = self._comparison
        if comparison is None or not self._pipe.poll():
            return None
        self._comparison = None
        took = time.monotonic() - self._started
        try:
            alignments, failure = self._pipe.recv()
        except (EOFError, ConnectionResetError):
            self._process.join()
            failure = f"the process that compares maps ended ({self._process.exitcode})"
            self._pipe.close()
            self._start_process()
            return ComparisonOutcome(comparison, None, took, failure)
        return ComparisonOutcome(comparison, alignments, took, failure)


def _serve(pipe: Connection, align: Aligner) -> None:
    """Compare what comes through `pipe` until its other end is closed."""
    # All else comes first where processors are few: mapping, versions.
    answer(pipe, LAST, lambda maps: _compare(align, *maps))


def _compare(
    align: Aligner, reference: RobotMap, other: RobotMap
) -> tuple[tuple[Alignment, ...] | None, str]:
    """Return the alignments, or what went wrong: a stranger's odd map must not end the process."""
    try:
        return tuple(align(reference, other)), ""
    except Exception:  # noqa: BLE001
        return None, traceback.format_exc()
