"""Background: counts the shape words of every recorded building, for how rare a shape is.

Of each building a histogram, from which no map can be rebuilt, into the package. Whatever is
measured in a building leaves that building's out (`benchmarks.pairs.without_buildings`).
"""

import argparse
from collections import defaultdict
from pathlib import Path

from benchmarks.logs import find_logs
from benchmarks.stretches import map_stretches
from benchmarks.tables import format_table
from mapweave.maps import RobotMap
from mapweave.shape.background import FILE, Counts, save_background
from mapweave.shape.rarity import RarityParameters, count_words, wall_ends


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Say which logs, how they are cut, and where the histograms go."""
    parser.add_argument("--logs", nargs="+", metavar="NAME", help="which logs (default all)")
    parser.add_argument(
        "--stretches", type=int, default=3, metavar="N", help="a log is cut into (3)"
    )
    parser.add_argument("--output", type=Path, default=FILE, help="%(default)s")


def run(options: argparse.Namespace) -> None:
    """Count, print how many words there are, write the histograms."""
    buildings: defaultdict[str, Counts] = defaultdict(Counts.none)
    for log in find_logs(options.logs):
        for stretch in map_stretches(log, options.stretches):
            buildings[log.building] = buildings[log.building].plus(words_of(stretch.robot_map))
    save_background(buildings, options.output)
    rows = [[n, str(int(c.count.sum())), str(len(c.words))] for n, c in sorted(buildings.items())]
    print(format_table(["building", "words", "different ones"], rows))
    print(f"{options.output}: {options.output.stat().st_size / 1000:.0f} kB")


def words_of(robot_map: RobotMap) -> Counts:
    """Count the words of a robot's map, component by component."""
    p, found = RarityParameters(), Counts.none()
    for component in robot_map.components:
        ends = wall_ends(robot_map.lines(component).segments, p)
        found = found.plus(count_words(ends, p))
    return found
