"""The wire: counts with which contexts of its coder begin, counted on maps of real logs.

What is written is part of the wire (`usual.txt`): after a change of it, programs of before read
other numbers. Sizes are told for each log with counts of the other logs, which is what a building
costs that nobody has seen.
"""

import argparse
from collections import Counter, defaultdict
from collections.abc import Hashable, Mapping
from dataclasses import replace
from pathlib import Path

from benchmarks.logs import find_logs
from benchmarks.tables import format_table
from mapweave.io.readers import read_scans
from mapweave.kernels.range_coder import Beginning, PythonEncoder, name_of
from mapweave.mapping.mapper import Mapper
from mapweave.maps import RobotMap
from mapweave.team.joint_builder import JointMapBuilder
from mapweave_protocol.wire.coding import entropy
from mapweave_protocol.wire.coding.trajectory_code import Clock
from mapweave_protocol.wire.geometry import ANOTHER, PackedLines, PackedSubmap
from mapweave_protocol.wire.map_message import Changes, Place
from mapweave_protocol.wire.model import JOINT_REACH

FILE = Path(entropy.__file__).with_name("usual.txt")
LOGS = "intel", "fr079", "csail", "seattle"
WEIGHT = 24  # seen decisions that a beginning counts for: what a map is like soon outweighs it
SEEN = 8  # times at least that a context came up


class Tally(PythonEncoder):
    """An encoder that remembers how often each decision came out in each context."""

    def __init__(self, beginning: Beginning | None = None) -> None:
        super().__init__(entropy.usual() if beginning is None else beginning, entropy.MAX_NUMBERS)
        self.tally: Counter[tuple[str, int]] = Counter()

    def bit(self, context: Hashable, value: int = 0) -> int:
        """Code and count a decision; see `Coder`."""
        self.tally[name_of(context), value] += 1
        return super().bit(context, value)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Say which logs."""
    parser.add_argument("--logs", default=",".join(LOGS), help="names (%(default)s)")
    parser.add_argument("--write", action="store_true", help="replace the counts of the wire")


def run(options: argparse.Namespace) -> None:
    """Map the logs, count, tell sizes, write."""
    maps = {log.name: _mapped(log.path) for log in find_logs(options.logs.split(","))}
    tallies = {name: tally(robot_map) for name, robot_map in maps.items()}
    rows = []
    for name, robot_map in maps.items():
        others = (counted for other, counted in tallies.items() if other != name)
        usual = Tally(), Tally(counts(*others))
        rows.append([name, *(str(len(_coded(encoder, robot_map))) for encoder in usual)])
    print(format_table(["log", "bytes", "with counts of the other logs"], rows))
    if options.write:
        FILE.write_text(told(counts(*tallies.values())), encoding="ascii")


def tally(robot_map: RobotMap) -> Counter[tuple[str, int]]:
    """Return how often each decision comes out when a map and its joint map are coded."""
    found: Counter[tuple[str, int]] = Counter()
    whole = robot_map.submaps
    for submaps in (whole, *((submap,) for submap in whole)):  # all at once, and as it grew
        encoder = Tally()
        _coded(encoder, replace(robot_map, submaps=submaps))
        found += encoder.tally
    for component in JointMapBuilder().build((robot_map,), (), 1).components:
        encoder = Tally()
        lines = PackedLines.pack(component.map, JOINT_REACH, component.segment_confidence)
        PackedLines.code(encoder, lines, confident=True)
        found += encoder.tally
    return found


def counts(*tallies: Mapping[tuple[str, int], int]) -> Beginning:
    """Return with which counts contexts are to begin."""
    seen: dict[str, list[int]] = defaultdict(lambda: [0, 0])
    for counted in tallies:
        for (name, value), times in counted.items():
            seen[name][value] += times
    return {name: _scaled(*times) for name, times in seen.items() if sum(times) >= SEEN}


def _scaled(zeros: int, ones: int) -> tuple[int, int]:
    share = (ones + 0.4) / (zeros + ones + 0.8)
    scaled = min(max(round(WEIGHT * share), 1), WEIGHT - 1)
    return WEIGHT - scaled, scaled


def told(usual: Beginning) -> str:
    """Return the text of the file."""
    return "".join(f"{name} {zeros} {ones}\n" for name, (zeros, ones) in sorted(usual.items()))


def _coded(encoder: PythonEncoder, robot_map: RobotMap) -> bytes:
    """Return the stream of a whole map."""
    clock = Clock()
    for submap in robot_map.submaps:
        encoder.bit(ANOTHER, 1)
        PackedSubmap.code(encoder, PackedSubmap.pack(submap), clock)
    encoder.bit(ANOTHER, 0)
    places = tuple(Place.of(submap) for submap in robot_map.submaps)
    Changes((), places, ()).code_places(encoder)
    return encoder.finish()


def _mapped(path: Path) -> RobotMap:
    mapper = Mapper("a")
    for scan in read_scans(path):
        mapper.add(scan)
    mapper.finish()
    return mapper.robot_map()
