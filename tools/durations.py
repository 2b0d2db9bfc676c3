"""How long the tests take, kept in ``tests/durations.json``.

``python -m tools.durations REPORT`` writes that file anew from a report by ``pytest --junitxml``.
By file of tests it has the seconds of each test that takes `MENTIONED` or longer, all its cases
together, and under ``""`` those of the others.
"""

import json
import sys
import xml.etree.ElementTree as ET
from collections import defaultdict
from pathlib import Path
from typing import TypeAlias

Durations: TypeAlias = dict[str, dict[str, float]]

FILE = Path(__file__).parents[1] / "tests" / "durations.json"
MENTIONED = 0.5  # [s]; shorter ones are not worth choosing among
REST = ""


def read_durations() -> Durations:
    """Return the seconds of tests by file and name, as they were recorded last."""
    durations: Durations = json.loads(FILE.read_text(encoding="utf-8"))
    return durations


def summed(report: str) -> Durations:
    """Return the seconds of tests by file and name, out of pytest's report in XML."""
    seconds: dict[str, dict[str, float]] = defaultdict(lambda: defaultdict(float))
    for case in ET.fromstring(report).iter("testcase"):
        file = case.attrib["classname"].replace(".", "/") + ".py"
        seconds[file][case.attrib["name"].partition("[")[0]] += float(case.attrib["time"])
    return {file: _mentioned(seconds[file]) for file in sorted(seconds)}


def _mentioned(seconds: dict[str, float]) -> dict[str, float]:
    long = {name: round(s, 1) for name, s in sorted(seconds.items()) if s >= MENTIONED}
    return {REST: round(sum(s for s in seconds.values() if s < MENTIONED), 1), **long}


if __name__ == "__main__":
    recorded = summed(Path(sys.argv[1]).read_text(encoding="utf-8"))
    FILE.write_text(json.dumps(recorded, indent=1) + "\n", encoding="utf-8")
