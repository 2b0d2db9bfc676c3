"""Fuzz every reader for a while: ``python -m tests.fuzz --seconds 60``, or ``make fuzz``.

Atheris (libFuzzer) watches which lines an input reaches, and tries on from those that reach new
ones. Each target runs in a process of its own; what breaks a rule is kept as a file.
"""

import argparse
import os
import re
import subprocess
import sys
from pathlib import Path

from tests.fuzz.targets import targets

ROOT = Path(__file__).parents[2]
PROTOCOL = ROOT / "protocol"


def main() -> int:
    """Fuzz all targets, or those that are named; return 1 if a rule was broken."""
    names = sorted(targets())
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz", description=__doc__)
    parser.add_argument("targets", nargs="*", metavar="TARGET", help=", ".join(names))
    parser.add_argument("--seconds", type=int, default=60, metavar="S", help="for each (60)")
    options = parser.parse_args()
    if unknown := set(options.targets) - set(names):
        parser.error(f"{', '.join(sorted(unknown))}: expected some of {', '.join(names)}")
    wanted = options.targets or names
    broken = [name for name in wanted if not _held(name, options.seconds)]
    print(f"{len(wanted) - len(broken)} of {len(wanted)} rules held")
    return 1 if broken else 0


def _held(name: str, seconds: int) -> bool:
    """Fuzz one target, say how far it came, return whether its rule held."""
    reached_by = [str(ROOT), str(PROTOCOL), os.environ.get("PYTHONPATH", "")]
    done = subprocess.run(
        [sys.executable, "-m", "tests.fuzz.one", name, str(seconds)],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(reached_by), "MAPWEAVE_PURE": "1"},
        capture_output=True,
        text=True,
        errors="replace",
        check=False,
    )
    tried = re.findall(r"stat::number_of_executed_units: *([0-9]+)", done.stderr)
    reached = re.findall(r"cov: ([0-9]+)", done.stderr)
    print(f"{name:24} {(tried or ['?'])[-1]:>9} inputs, {(reached or ['?'])[-1]:>6} places reached")
    if done.returncode:
        print(*done.stdout.splitlines()[-40:], *done.stderr.splitlines()[-40:], sep="\n")
    return done.returncode == 0


if __name__ == "__main__":
    sys.exit(main())
