"""A robot that drives lap after lap: time per scan and memory, however long it drives.

The laps are one log played again and again: at the start of each the robot is carried back without
a sign, says that it is lost, and finds itself again.
"""

import argparse
import resource
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from itertools import cycle, islice
from pathlib import Path

import numpy as np

from benchmarks.logs import find_logs, load_scans, load_truth
from benchmarks.tables import OUTPUT, format_table, write_json
from benchmarks.truth import paths, position_error, steps_right
from mapweave.commands.progress import track
from mapweave.geometry.arrays import FloatArray
from mapweave.mapping.mapper import Mapper, MapperParameters
from mapweave.maps import RobotMap
from mapweave.scan.scan import Scan
from mapweave_agent.backend_process import BackendProcess

HEAD = ["scans", "ms/scan", "median ms", "slowest ms", "resident MB", "components", "submaps"]


@dataclass(frozen=True, slots=True)
class Stretch:
    """What mapping came to up to some scan.

    Attributes
    ----------
    scans
        How many so far.
    mean, median, slowest
        [s] per scan since the last stretch, on a machine that may have been busy.
    memory
        [bytes] resident now, of the process that tracks.
    components, submaps
        In the map so far.
    """

    scans: int
    mean: float
    median: float
    slowest: float
    memory: int
    components: int
    submaps: int


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Say which log, and how long."""
    parser.add_argument("--log", default="intel", metavar="NAME", help="played on (%(default)s)")
    parser.add_argument("--scans", type=int, default=20_000, help="in all (%(default)s)")
    parser.add_argument("--every", type=int, default=1000, help="scans a row (%(default)s)")
    parser.add_argument(
        "--here",
        action="store_true",
        help="settle submaps in between, as mapweave map does, not beside, as an agent does",
    )
    parser.add_argument(
        "--output", type=Path, default=OUTPUT / "endurance", help="folder (%(default)s)"
    )


def run(options: argparse.Namespace) -> None:
    """Map the laps, print the table, write the figures."""
    (log,) = find_logs([options.log])
    scans = load_scans(log)
    truth = load_truth(log, np.array([scan.stamp for scan in scans]))
    order = list(islice(cycle(range(len(scans))), options.scans))
    parameters = MapperParameters()
    if options.here:
        mapper = Mapper("r1", parameters=parameters)
        stretches = _map(mapper, scans, order, options.every)
    else:
        with BackendProcess(parameters.backend) as backend:
            mapper = Mapper("r1", parameters=parameters, backend=backend)
            stretches = _map(mapper, scans, order, options.every)
    print(format_table(HEAD, [_row(s) for s in stretches]))
    print(_tell(mapper.robot_map(), truth[order]))
    options.output.mkdir(parents=True, exist_ok=True)
    write_json(options.output / "figures.json", [asdict(s) for s in stretches])


def _map(mapper: Mapper, scans: Sequence[Scan], order: Sequence[int], every: int) -> list[Stretch]:
    stretches = []
    times: list[float] = []
    for number, scan in enumerate(track(_renumbered(scans, order), "mapping", len(order)), 1):
        start = time.perf_counter()
        mapper.add(scan)
        times.append(time.perf_counter() - start)
        if number % every == 0:
            stretches.append(_stretch(number, times, mapper.robot_map()))
            print("  ".join(_row(stretches[-1])), file=sys.stderr, flush=True)
            times = []
    mapper.finish()
    return stretches


def _renumbered(scans: Sequence[Scan], order: Sequence[int]) -> Iterator[Scan]:
    for number, k in enumerate(order):
        yield Scan(scans[k].ranges, scans[k].angles, number, float(number))


def _stretch(number: int, times: Sequence[float], robot_map: RobotMap) -> Stretch:
    return Stretch(
        number,
        float(np.mean(times)),
        float(np.median(times)),
        float(np.max(times)),
        _resident(),
        len(robot_map.components),
        len(robot_map.submaps),
    )


def _resident() -> int:
    """[bytes] of memory that this process holds now."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * resource.getpagesize()


def _row(s: Stretch) -> list[str]:
    return [
        str(s.scans),
        f"{1000 * s.mean:.1f}",
        f"{1000 * s.median:.1f}",
        f"{1000 * s.slowest:.0f}",
        f"{s.memory / 1e6:.0f}",
        str(s.components),
        str(s.submaps),
    ]


def _tell(robot_map: RobotMap, truth: FloatArray) -> str:
    found = paths(robot_map)
    right = steps_right(found, truth)
    return (
        f"{len(found[0].index)} of {len(truth)} scans in the largest component, steps right"
        f" {right.mean():.2%}, position error {position_error(found[0], truth):.3f} m"
    )
