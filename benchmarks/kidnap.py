"""A kidnapped robot: carried off without a sign, it says so, and finds itself again.

Scans 0-60 % of a log are mapped; then follow 100 scans from a random place in its first half. Each
of those was mapped before, so the map itself says where it belongs.
"""

import argparse
import copy
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

from benchmarks.logs import Log, find_logs, load_scans
from benchmarks.tables import OUTPUT, format_table, write_json
from mapweave.commands.progress import track
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.mapping.mapper import Mapper, MapperParameters
from mapweave.maps import RobotMap
from mapweave.scan.scan import Scan

USUAL = ("fr079", "intel-lab", "intel", "csail-thinned", "seattle")
MAPPED, HALF = 0.6, 0.5  # shares of the log: mapped first, and drawn from
LENGTH = 100  # scans after the jump
FARTHER = 3.0  # [m] jumped at least: a shorter way may have been a step
DISTANCE, TURN = 1.0, np.radians(10.0)  # [m], [rad] off which a scan is misplaced
MOST = 0.5  # share of the scans that must be back where they belong: rejoined
STRAY = 5  # scans misplaced in a row of a trial that make a wrong place; fewer are single ones
HEAD = ["log", "trials", "noticed", "said lost", "rejoined", "wrong places", "strays"]
HEAD += ["median m", "worst m"]

Where = Mapping[int, tuple[int, FloatArray]]


@dataclass(frozen=True, slots=True)
class Trial:
    """What became of one kidnapping.

    Attributes
    ----------
    trial
        Its number, which seeds the draw.
    start
        The first scan after the jump.
    jump
        [m] between it and the last scan before, as mapped.
    noticed
        Whether the first scan after the jump fitted nowhere when it came.
    lost_after
        How many scans after the jump the robot was said to be lost; None if it never was.
    placed, back
        Of the scans after the jump: in the map at the end, and in the component of their first
        mapping.
    known
        Of the scans after the jump: placed when first mapped.
    misplaced
        Of those back: off where they were first mapped.
    longest
        The most of those misplaced in a row.
    median, worst
        [m] between the two places of those back; NaN if none is.
    """

    log: str
    trial: int
    start: int
    jump: float
    noticed: bool
    lost_after: int | None
    placed: int
    back: int
    known: int
    misplaced: int
    longest: int
    median: float
    worst: float
    patience: int

    @property
    def said_lost(self) -> bool:
        """Whether the robot was said to be lost as soon as patience allows.

        One that the first scans did not fit, and that then found itself, never was.
        """
        return self.lost_after is not None and self.lost_after <= self.patience

    @property
    def wrong(self) -> bool:
        """Whether the robot was, for a while, at a wrong place of the map."""
        return self.longest >= STRAY

    @property
    def rejoined(self) -> bool:
        """Whether most of the scans are back, and at the right place."""
        return self.back >= MOST * self.known and not self.wrong


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Say which logs, which trials, and where the figures go."""
    parser.add_argument("--logs", nargs="+", default=USUAL, metavar="NAME", help=" ".join(USUAL))
    parser.add_argument(
        "--trials", nargs="+", type=int, default=range(10), metavar="K", help="which (0 to 9)"
    )
    parser.add_argument("--output", type=Path, default=OUTPUT / "kidnap", help="folder")


def run(options: argparse.Namespace) -> None:
    """Kidnap the robot in each log, print the table, write the trials."""
    trials: list[Trial] = []
    for log in find_logs(options.logs):
        trials += kidnap(log, options.trials)
        write_json(options.output / "trials.json", [asdict(trial) for trial in trials])
    print(tell(trials))


def kidnap(log: Log, numbers: Sequence[int]) -> Iterator[Trial]:
    """Yield the trials called `numbers` of one log, each told when it is over."""
    scans = load_scans(log)
    mapper = map_first_part(log.name, scans)
    for number in numbers:
        trial = try_once(log.name, scans, mapper, number)
        print(tell_one(trial))
        yield trial


def map_first_part(name: str, scans: Sequence[Scan]) -> Mapper:
    """Return the mapper after the part of `scans` that comes before the jump."""
    mapper = Mapper("r1")
    first = scans[: int(MAPPED * len(scans))]
    for scan in track(first, f"mapping {MAPPED:.0%} of {name}", len(first)):
        mapper.add(scan)
    return mapper


def try_once(name: str, scans: Sequence[Scan], mapper: Mapper, number: int) -> Trial:
    """Kidnap a copy of `mapper`, by the draw that `number` seeds, and judge what it makes of it."""
    carried = copy.deepcopy(mapper)
    start, jump = draw(carried.robot_map(), len(scans), number)
    said = [carried.add(scan) for scan in after_the_jump(scans, start)]
    where = whereabouts(carried.finish())
    errors = off_first_place(where, len(scans), start)
    bad = [bool(distance > DISTANCE or turn > TURN) for _, distance, turn in errors]
    distances = [distance for _, distance, _ in errors]
    return Trial(
        log=name,
        trial=number,
        start=start,
        jump=jump,
        noticed=not said[0].placed,
        lost_after=next((k for k, one in enumerate(said, start=1) if one.lost), None),
        placed=sum(index >= len(scans) for index in where),
        back=len(errors),
        known=sum(start + k in where for k in range(LENGTH)),
        misplaced=sum(bad),
        longest=_longest_run(bad),
        median=float(np.median(distances)) if distances else np.nan,
        worst=max(distances, default=np.nan),
        patience=MapperParameters().patience,
    )


def draw(first_part: RobotMap, scans: int, number: int) -> tuple[int, float]:
    """Return a random scan in the first half of the log, and how far [m] the jump to it is.

    Drawn again while it is nearer than a step may be, in the map of the `first_part`.
    """
    rng = np.random.default_rng(number)
    where = whereabouts(first_part)
    component, last = where[max(where)]
    while True:
        start = int(rng.integers(0, int(HALF * scans) - LENGTH))
        if start in where:
            there, pose = where[start]
            jump = float(np.hypot(*(pose - last)[:2])) if there == component else np.inf
            if jump > FARTHER:
                return start, jump


def after_the_jump(scans: Sequence[Scan], start: int) -> Iterator[Scan]:
    """Yield the scans from `start` on as if they came after all others; nothing tells of it."""
    last = scans[int(MAPPED * len(scans)) - 1]
    for scan in scans[start : start + LENGTH]:
        stamp = last.stamp + scan.stamp - scans[start].stamp
        yield replace(scan, index=len(scans) + scan.index, stamp=stamp)


def whereabouts(robot_map: RobotMap) -> dict[int, tuple[int, FloatArray]]:
    """Return of each scan its component and its pose (3,) in it."""
    return {
        int(index): (submap.component, pose)
        for submap in robot_map.submaps
        for index, pose in zip(
            submap.trajectory.scan_index,
            se2.compose(submap.pose, submap.trajectory.pose),
            strict=True,
        )
    }


def off_first_place(where: Where, scans: int, start: int) -> list[tuple[int, float, float]]:
    """Return of each scan that is back: its index, how far [m] and turned [rad] from its place.

    A scan is back when it is in the component that it was in when it was first mapped.
    """
    found = []
    for index in range(start, start + LENGTH):
        first, again = where.get(index), where.get(scans + index)
        if first is not None and again is not None and first[0] == again[0]:
            x, y, turn = se2.between(first[1], again[1])
            found.append((index, float(np.hypot(x, y)), abs(float(turn))))
    return found


def _longest_run(flags: Sequence[bool]) -> int:
    longest = current = 0
    for flag in flags:
        current = current + 1 if flag else 0
        longest = max(longest, current)
    return longest


def tell_one(trial: Trial) -> str:
    """Return a line on one trial."""
    lost = "noticed" if trial.noticed else "not noticed"
    lost += ", never lost" if trial.lost_after is None else f", lost after {trial.lost_after}"
    verdict = "wrong place" if trial.wrong else "rejoined" if trial.rejoined else "apart"
    return (
        f"{trial.log} trial {trial.trial}: from scan {trial.start}, {trial.jump:.1f} m off: {lost},"
        f" {trial.placed} placed, {trial.back} of {trial.known} back, {trial.misplaced} misplaced,"
        f" off {trial.median:.2f} m (median) {trial.worst:.2f} m (worst): {verdict}"
    )


def tell(trials: Sequence[Trial]) -> str:
    """Return the table, a row for each log."""
    rows = []
    for log in dict.fromkeys(trial.log for trial in trials):
        of_log = [trial for trial in trials if trial.log == log]
        rejoined = [trial for trial in of_log if trial.rejoined]
        rows.append(
            [
                log,
                str(len(of_log)),
                str(sum(trial.noticed for trial in of_log)),
                str(sum(trial.said_lost for trial in of_log)),
                str(len(rejoined)),
                str(sum(trial.wrong for trial in of_log)),
                str(sum(trial.misplaced for trial in of_log if not trial.wrong)),
                f"{np.median([trial.median for trial in rejoined]):.3f}" if rejoined else "-",
                f"{max(trial.worst for trial in rejoined):.2f}" if rejoined else "-",
            ]
        )
    return format_table(HEAD, rows)
