"""A comparison in a real process of its own."""

import operator
import os
import signal
import subprocess
import sys
import time
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from mapweave.fusion.align import FusionParameters, align
from mapweave.maps import LineMap, RobotMap, Submap, Trajectory
from mapweave_agent.comparison_schedule import Comparison
from mapweave_agent.comparison_worker import ComparisonOutcome, ComparisonWorker

PATIENCE = 60.0  # [s]
ROOT = Path(__file__).parents[2]


def outcome_of(comparer: ComparisonWorker) -> ComparisonOutcome:
    deadline = time.monotonic() + PATIENCE
    while (outcome := comparer.take()) is None:
        assert time.monotonic() < deadline
        time.sleep(0.01)
    return outcome


def corner(robot: str) -> RobotMap:
    segments = np.array([[0, 0, 1, 0], [1, 0, 1, 1]], dtype=float)
    lines = LineMap(segments, np.zeros(2, dtype=np.int64), np.ones(2, dtype=np.int64))
    return RobotMap(robot, "x", 1, (Submap(0, 0, np.zeros(3), lines, Trajectory.empty()),))


COMPARISON = Comparison("b", corner("a"), corner("b"))


def test_what_comes_back_is_what_the_function_returns() -> None:
    with ComparisonWorker(align) as comparer:
        comparer.start(COMPARISON)
        assert comparer.busy
        outcome = outcome_of(comparer)
    assert not comparer.busy
    assert outcome.comparison is COMPARISON
    (expected,) = align(corner("a"), corner("b"))
    assert outcome.alignments is not None
    (alignment,) = outcome.alignments
    assert (alignment.decision, alignment.reason) == (expected.decision, expected.reason)


AS_NICE_AS_CAN_BE = """
import os

from mapweave.fusion.align import align
from mapweave_agent.comparison_worker import ComparisonWorker
from tests.agent.test_comparison_worker import COMPARISON, outcome_of

if __name__ == "__main__":
    os.nice(19)
    with ComparisonWorker(align) as comparer:
        comparer.start(COMPARISON)
        outcome_of(comparer)
        print(os.sched_getscheduler(comparer.pid))
"""


@pytest.mark.skipif(not hasattr(os, "SCHED_IDLE"), reason="schedulers as Linux has them")
def test_maps_are_compared_after_all_else_but_never_not_at_all() -> None:
    """Beside an agent that is as nice as can be, comparing runs where nothing else would."""
    with ComparisonWorker(align) as comparer:
        comparer.start(COMPARISON)
        outcome_of(comparer)
        assert os.sched_getscheduler(comparer.pid) == os.SCHED_OTHER
        assert os.getpriority(os.PRIO_PROCESS, comparer.pid) == 19
    command = [sys.executable, "-c", AS_NICE_AS_CAN_BE]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout.split() == [str(os.SCHED_IDLE)]


def test_a_function_takes_its_parameters_along() -> None:
    demanding = partial(align, parameters=FusionParameters(min_wall=77.0))
    with ComparisonWorker(demanding) as comparer:
        comparer.start(COMPARISON)
        outcome = outcome_of(comparer)
    assert outcome.alignments is not None
    assert [a.reason for a in outcome.alignments] == ["a/0 has less than 77 m of wall to compare"]


def test_an_error_is_an_outcome_and_the_next_comparison_goes_on() -> None:
    with ComparisonWorker(operator.mul) as comparer:
        for _ in range(2):
            comparer.start(COMPARISON)
            outcome = outcome_of(comparer)
            assert outcome.alignments is None
            assert "TypeError" in outcome.failure


def test_a_process_that_was_killed_is_an_outcome_and_is_replaced() -> None:
    with ComparisonWorker(align) as comparer:
        comparer.start(COMPARISON)
        os.kill(comparer.pid, signal.SIGKILL)
        outcomes = [outcome_of(comparer)]
        comparer.start(COMPARISON)
        outcomes.append(outcome_of(comparer))
    assert [outcome.alignments is None for outcome in outcomes] == [True, False]
    assert "-9" in outcomes[0].failure


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGTERM])
def test_what_tells_the_whole_group_to_end_is_the_agents_to_hear(how: signal.Signals) -> None:
    with ComparisonWorker(operator.mul) as comparer:
        os.kill(comparer.pid, how)
        comparer.start(COMPARISON)
        assert "TypeError" in outcome_of(comparer).failure
        os.kill(comparer.pid, how)  # also one that is at work
        comparer.start(COMPARISON)
        assert "TypeError" in outcome_of(comparer).failure


def test_the_process_ends_with_its_context() -> None:
    with ComparisonWorker(align) as comparer:
        pid = comparer.pid
        os.kill(pid, 0)
        comparer.start(COMPARISON)
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return
    raise AssertionError(f"process {pid} is still there")
