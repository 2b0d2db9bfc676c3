"""Mapping scans, with how long it took; optionally remembered."""

import hashlib
import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import mapweave
from benchmarks.killian import CACHE
from mapweave.commands.progress import track
from mapweave.io.map_files import read_map, write_map
from mapweave.mapping.mapper import Mapper
from mapweave.maps import RobotMap
from mapweave.scan.scan import Scan


@dataclass(frozen=True, slots=True, eq=False)
class Run:
    """A map and the seconds it took."""

    robot_map: RobotMap
    seconds: float


def map_scans(name: str, scans: Sequence[Scan], robot: str = "r1") -> Run:
    """Map `scans` as ``mapweave map`` does: without odometry, default parameters."""
    mapper = Mapper(robot)
    start = time.perf_counter()
    for scan in track(scans, f"mapping {name}", len(scans)):
        mapper.add(scan)
    robot_map = mapper.finish()
    return Run(robot_map, time.perf_counter() - start)


def map_remembered(name: str, log: Path, scans: Sequence[Scan], robot: str) -> RobotMap:
    """Return the map of `scans` of `log`; mapped only when neither they nor mapweave are known."""
    file = CACHE / "maps" / f"{_fingerprint(log, scans, robot)}.json"
    if not file.is_file():
        file.parent.mkdir(parents=True, exist_ok=True)
        write_map(file, map_scans(name, scans, robot).robot_map)
    return read_map(file)


def _fingerprint(log: Path, scans: Sequence[Scan], robot: str) -> str:
    """Name what a map depends on: the sources, the log, the scans, the robot's name."""
    digest = hashlib.sha256(f"{robot} {scans[0].index} {scans[-1].index} {len(scans)}".encode())
    digest.update(sources())
    digest.update(log.read_bytes())
    return digest.hexdigest()[:24]


@cache
def sources() -> bytes:
    """Return a digest of mapweave's sources, once: those that this process runs."""
    digest = hashlib.sha256()
    package = Path(mapweave.__file__).parent
    for source in sorted(package.rglob("*.py")):
        digest.update(source.relative_to(package).as_posix().encode())
        digest.update(source.read_bytes())
    return digest.digest()
