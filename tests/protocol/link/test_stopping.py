"""The first signal asks to stop; the same told again changes nothing, and a later one ends."""

import signal
import subprocess
import sys

import pytest

from mapweave_protocol.link import stopping

TOLD_TWICE = """
import signal
import mapweave_protocol.link.stopping as module
from mapweave_protocol.link.stopping import StopSignals

module.REPEATED = {repeated}
stopping = StopSignals()
assert not stopping()
later = []
{before}
    signal.raise_signal(signal.{how})
    assert stopping()
    signal.raise_signal(signal.{how})
    assert stopping()
print(len(later))
"""
AT_REST = "if True:"
NOTHING_LOST = "with stopping.nothing_lost(lambda: later.append(1)):"


def told_twice(how: signal.Signals, before: str, repeated: float) -> tuple[int, str]:
    script = TOLD_TWICE.format(how=how.name, before=before, repeated=repeated)
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, timeout=60
    )
    assert not done.stderr
    return done.returncode, done.stdout.strip()


@pytest.mark.parametrize("how", stopping.STOP_SIGNALS)
def test_the_same_signal_told_again_changes_nothing(how: signal.Signals) -> None:
    assert told_twice(how, AT_REST, 60.0) == (0, "0")
    assert told_twice(how, NOTHING_LOST, 60.0) == (0, "0")


@pytest.mark.parametrize("how", stopping.STOP_SIGNALS)
def test_a_later_signal_ends_at_once_unless_something_would_be_lost(how: signal.Signals) -> None:
    assert told_twice(how, AT_REST, -1.0) == (-how, "")
    assert told_twice(how, NOTHING_LOST, -1.0) == (0, "1")
