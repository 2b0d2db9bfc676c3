"""Mapping scans, with how long it took; optionally remembered."""

import hashlib
import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import grimp  # what import-linter reads imports with

import mapweave
from benchmarks.killian import CACHE
from mapweave.commands.progress import track
from mapweave.io.map_files import read_map, write_map
from mapweave.mapping.mapper import Mapper
from mapweave.maps import RobotMap
from mapweave.scan.scan import Scan
from mapweave.shape.background import FILE as BACKGROUND

MAPPING, COMPARING = "mapweave.mapping.mapper", "mapweave.fusion.align"


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
    digest.update(sources(MAPPING))
    digest.update(log.read_bytes())
    return digest.hexdigest()[:24]


@cache
def sources(*modules: str) -> bytes:
    """Return a digest of what `modules` of mapweave run, once: theirs, what they import, kernels.

    So what is remembered stays so as long as nothing that it comes of is changed.
    """
    package, graph = Path(mapweave.__file__).parent, _imports()
    used = set(modules).union(*(graph.find_upstream_modules(module) for module in modules))
    kernels = (p for p in (package / "kernels").rglob("*") if p.suffix in (".hpp", ".cpp"))
    files = {_file(package, module) for module in used} | {*kernels, BACKGROUND}
    digest = hashlib.sha256()
    for file in sorted(files):
        digest.update(file.relative_to(package).as_posix().encode())
        digest.update(file.read_bytes())
    return digest.digest()


@cache
def _imports() -> grimp.ImportGraph:
    return grimp.build_graph("mapweave", cache_dir=None)


def _file(package: Path, module: str) -> Path:
    path = package.joinpath(*module.split(".")[1:])
    return path / "__init__.py" if path.is_dir() else path.with_suffix(".py")
