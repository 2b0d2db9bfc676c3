"""A team over links that lose packets and are slow: its joint map, and how many bytes it takes.

Each robot's link loses a share of its packets, each way, and takes its time; TCP sends them again,
which the relay plays as the wait that it is. Bytes are what robots send and get at the relay.
"""

import argparse
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import mapweave_protocol
from benchmarks.faults.trial import Trial, team_on_trial, two_in_the_same_rooms, until
from benchmarks.tables import OUTPUT, format_table, write_json
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray

LINKS = (0.0, 0.0), (0.05, 0.0), (0.2, 0.0), (0.0, 0.2), (0.05, 0.2)  # loss, delay [s]
DISTANCE, ANGLE, MORE = 0.1, np.radians(1.0), 1.3  # [m], [rad], times the bytes
RATE = 4.0
SETTLING = 10.0  # [s] after they are joined, as bytes are counted


@dataclass(frozen=True)
class Result:
    """What a team came to over some links.

    Attributes
    ----------
    other
        (3,) where the second robot's component is in the first one's [m, m, rad].
    scans
        In the maps that the coordinator holds.
    size
        Bytes that robots sent and got.
    """

    loss: float
    delay: float
    other: FloatArray
    scans: int
    size: int

    def differs(self, perfect: "Result") -> str:
        """Return in what it is not as good as over perfect links; nothing if it is."""
        apart = se2.between(perfect.other, self.other)
        wrong = []
        if np.hypot(*apart[:2]) > DISTANCE or abs(se2.wrap(apart[2])) > ANGLE:
            wrong.append(f"off by {np.hypot(*apart[:2]):.2f} m")
        if self.scans != perfect.scans:
            wrong.append(f"{perfect.scans - self.scans} scans lost")
        if self.size > MORE * perfect.size:
            wrong.append(f"{self.size / perfect.size:.2f} times the bytes")
        return ", ".join(wrong)


def drive(folder: Path, loss: float, delay: float) -> Result:
    """Let two robots map the same rooms over such links."""
    members = two_in_the_same_rooms()
    with team_on_trial(folder, members, f"{RATE:g}", loss=loss, delay=delay) as trial:
        trial.start_coordinator()
        for robot in trial.plan.robots:
            trial.start_robot(robot)
        until(lambda: _is_done(trial), "a team that is done")
        time.sleep(SETTLING)
        listen = [trial.plan.listen]
        joint = next(mapweave_protocol.joint_maps("t", connect=listen))
        maps = mapweave_protocol.robot_maps("t", connect=listen, timeout=3.0)
        held = {m.robot: sum(len(s.trajectory.scan_index) for s in m.submaps) for m in maps}
        size = sum(trial.links[r].sent + trial.links[r].received for r in trial.plan.robots)
    [part] = joint.components
    other = se2.between(part.robots["r1/0"], part.robots["r2/0"])
    return Result(loss, delay, other, sum(held.values()), size)


def _is_done(trial: Trial) -> bool:
    parked = all(trial.says(f"agent-{robot}", "finished:") for robot in trial.plan.robots)
    return parked and trial.says("server", ": r1/0 + r2/0")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Say where results go."""
    parser.add_argument("--output", type=Path, default=OUTPUT / "lossy", help="folder")


def run(options: argparse.Namespace) -> None:
    """Try all links, print what each came to; fail if one is not as good as a perfect one."""
    results = []
    for loss, delay in LINKS:
        with tempfile.TemporaryDirectory() as folder:
            results.append(drive(Path(folder), loss, delay))
    perfect = results[0]
    rows = [
        [f"{r.loss:.0%}", f"{1000 * r.delay:.0f}", f"{r.size / 1000:.1f}",
         f"{r.size / perfect.size:.2f}", str(r.scans), r.differs(perfect) or "nothing"]
        for r in results
    ]  # fmt: skip
    print(format_table(["loss", "delay ms", "kB", "times", "scans", "worse in"], rows))
    good = sum(not result.differs(perfect) for result in results)
    print(f"as good as perfect, at most {MORE:g} times the bytes: {good} of {len(rows)}, bar: all")
    write_json(options.output / "lossy.json", rows)
    if good < len(rows):
        sys.exit(1)
