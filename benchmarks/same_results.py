"""Compare maps and joint maps of this checkout with those of another commit, number for number.

Both are installed without their dependencies, each into a folder of its own, and asked by command
line for the map of each log, the maps of its stretches, and the joint map of these; so the same
numpy, scipy and gtsam serve both. What one of them made stays and is used again, until its
sources or the dependencies change.
"""

import argparse
import hashlib
import json
import os
import re
import subprocess
import sys
import sysconfig
import tempfile
from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from importlib.metadata import distributions
from itertools import chain, pairwise
from pathlib import Path

from benchmarks.logs import Log, find_logs, load_scans
from benchmarks.tables import OUTPUT, format_table

LAST_BEFORE_THE_ROOMS = "9ec7a9d"
LOGS = ("seattle", "fr079", "intel", "csail-thinned")
STRETCHES = 4
ROOT = Path(__file__).parents[1]
FOLDER = OUTPUT / "same-results"
IGNORED = {"boot", "made_with", "reason"}  # who made it, with what, and prose
# Which part of a file a path belongs to, such as ``submaps[3].pose[0]``: the first that fits.
PARTS = {
    "alignments": re.compile(r"^alignments"),
    "support": re.compile(r"\b(support|segment_confidence)\b"),
    "segments": re.compile(r"\bpolylines\b"),
    "poses": re.compile(r"\b(pose|robots)\b"),
    "trajectories": re.compile(r"\b(trajectory|uncertainty)\b"),
    "rest": re.compile(""),
}


@dataclass(frozen=True, slots=True)
class Tree:
    """A commit, or this checkout, as it is installed.

    Attributes
    ----------
    site
        The folder it is installed in, without what it depends on.
    results
        The folder of its maps.
    """

    site: Path
    results: Path

    def run(self, *words: str | Path) -> None:
        """Run ``mapweave`` with `words`; exit status 3, not all maps joined, is a result too.

        Raises
        ------
        SystemExit
            If it fails.
        """
        folders = os.pathsep.join([str(self.site), sysconfig.get_path("purelib")])
        environment = {**os.environ, "PYTHONPATH": folders, "PYTHONSAFEPATH": "1"}
        environment.pop("OPENBLAS_NUM_THREADS", None)  # each commit says it itself
        # -S: what is installed as editable would come before everything else.
        command = [sys.executable, "-S", "-m", "mapweave", *map(str, words)]
        done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
        if done.returncode not in (0, 3):
            raise SystemExit(f"{self.results.name}: {' '.join(command[3:])}: {done.stderr.strip()}")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add what can be chosen."""
    parser.add_argument(
        "--commit",
        default=LAST_BEFORE_THE_ROOMS,
        help="to compare with; default: %(default)s, the last before the rooms",
    )
    parser.add_argument("--logs", nargs="+", metavar="LOG", default=LOGS, help="only these logs")
    parser.add_argument(
        "--processes", type=int, default=os.cpu_count() or 1, help="at a time; default: %(default)s"
    )


def run(options: argparse.Namespace) -> None:
    """Map and fuse with both, compare, print a table.

    Raises
    ------
    SystemExit
        With status 1 if anything differs, or cannot be made.
    """
    logs = {log: _stretches(log) for log in find_logs(options.logs)}
    if not logs:
        raise SystemExit("there is no log to compare on")
    with tempfile.TemporaryDirectory() as folder:
        trees = install_commit(options.commit, Path(folder)), _install(ROOT, Path(folder) / "new")
        with ThreadPoolExecutor(options.processes) as pool:
            tasks = [pool.submit(_make, t, log, logs[log]) for log in logs for t in trees]
            for task in tasks:
                task.result()
    files = list(chain.from_iterable(map(_files, logs)))
    differing = {file: _compare(*(tree.results / file for tree in trees)) for file in files}
    _print_table(differing, [tree.results for tree in trees])
    if any(differing.values()):
        raise SystemExit(1)


def _stretches(log: Log) -> list[tuple[int, int]]:
    """Return where its stretches of equal numbers of scans begin and end."""
    count = len(load_scans(log))
    return list(pairwise(count * k // STRETCHES for k in range(STRETCHES + 1)))


def install_commit(commit: str, folder: Path) -> Tree:
    """Install `commit` from a work tree that is there only meanwhile."""
    name = _run("git", "rev-parse", "--verify", "--short", f"{commit}^{{commit}}")
    checkout = folder / "checkout"
    _run("git", "worktree", "add", "--detach", str(checkout), name)
    try:
        return _install(checkout, folder / "old")
    finally:
        _run("git", "worktree", "remove", "--force", str(checkout))


def _install(checkout: Path, site: Path) -> Tree:
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "install", "--quiet"]
    _run(*pip, "--no-deps", "--target", str(site), str(checkout))
    return Tree(site, (FOLDER / _fingerprint(site)).resolve())


def _fingerprint(site: Path) -> str:
    """Name what results depend on: the sources, and each installed distribution's version."""
    digest = hashlib.sha256()
    for source in sorted(site.rglob("*.py")):
        digest.update(source.relative_to(site).as_posix().encode())
        digest.update(source.read_bytes())
    for found in sorted(f"{each.name} {each.version}" for each in distributions()):
        digest.update(found.encode())
    return digest.hexdigest()[:12]


def _run(*command: str) -> str:
    """Return what `command` prints, run in this checkout; SystemExit with its error otherwise."""
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise SystemExit(f"{' '.join(command)}: {done.stderr.strip()}")
    return done.stdout.strip()


def _files(log: Log) -> list[str]:
    """Return the names of the results of `log`: its map, those of its stretches, the joint map."""
    stretches = [f"{log.name}.{k}.json" for k in range(STRETCHES)]
    return [f"{log.name}.json", *stretches, f"{log.name}.joint.json"]


def _make(tree: Tree, log: Log, stretches: Sequence[tuple[int, int]]) -> None:
    """Make the results of `log` that are not there; a file is there when it is whole."""
    tree.results.mkdir(parents=True, exist_ok=True)
    whole, *parts, joint = (tree.results / name for name in _files(log))
    if not whole.is_file():
        tree.run("map", log.path, "--robot", "r1", "--output", whole)
    for k, (part, (start, end)) in enumerate(zip(parts, stretches, strict=True)):
        if not part.is_file():
            selected = f"{start}:{end}"
            tree.run("map", log.path, "--scans", selected, "--robot", f"s{k}", "--output", part)
    if not joint.is_file():
        tree.run("fuse", *parts, "--output", joint)


def _compare(old: Path, new: Path) -> list[str]:
    """Return the paths of what differs between two files."""
    return list(differences(*(json.loads(file.read_text()) for file in (old, new))))


def differences(old: object, new: object, path: str = "") -> Iterator[str]:
    """Yield the paths where `new` has not what `old` has; fields that only `new` has may be there.

    Parameters
    ----------
    old, new
        As read from JSON.
    path
        Of both within their files, such as ``submaps[3].pose``.
    """
    if isinstance(old, dict) and isinstance(new, dict):
        for name in old.keys() - IGNORED:
            below = f"{path}.{name}".lstrip(".")
            yield from differences(old[name], new[name], below) if name in new else [below]
    elif isinstance(old, list) and isinstance(new, list) and len(old) == len(new):
        for k, pair in enumerate(zip(old, new, strict=True)):
            yield from differences(*pair, f"{path}[{k}]")
    elif old != new:
        yield path


def _print_table(differing: dict[str, list[str]], folders: Sequence[Path]) -> None:
    """Print how much differs in each part of each file, and the first that does."""
    rows = []
    for file, paths in differing.items():
        found = Counter(part_of(path) for path in paths)
        rows.append([file, *(str(found[part] or "same") for part in PARTS)])
    print(f"what {folders[0]} has and {folders[1]} has not, counted")
    print(format_table(["", *PARTS], rows))
    for file, paths in differing.items():
        if paths:
            print(
                f"{file}: {paths[0]} differs" + (f", and {len(paths) - 1} more" * (len(paths) > 1))
            )


def part_of(path: str) -> str:
    """Return the part of a file that `path` belongs to."""
    return next(part for part, pattern in PARTS.items() if pattern.search(path))
