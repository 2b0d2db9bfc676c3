"""The real logs that are measured on, and what is known of them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from benchmarks.killian import KILLIAN, fetch_killian
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.io.readers import read_reference_poses, read_scans
from mapweave.scan.scan import Scan
from tests.conftest import DATA


@dataclass(frozen=True, slots=True)
class Log:
    """A recording of one robot.

    Attributes
    ----------
    name
        Short, for tables and file names.
    building
        Logs of one building are never compared as if they were of two.
    path
        Where its scans are.
    truth
        The log that holds the corrected poses: itself, or one whose scans have the same stamps.
    relations
        Ground-truth relations between its scans, where there are any.
    """

    name: str
    building: str
    path: Path
    truth: Path
    relations: Path | None = None


def find_logs(names: Sequence[str] | None = None) -> list[Log]:
    """Return the logs called `names`, or all; say which ones are missing and leave them out.

    Raises
    ------
    SystemExit
        If there is no log of that name.
    """
    known = {log.name: log for log in _known_logs()}
    for name in names or ():
        if name not in known:
            raise SystemExit(f"{name}: no such log; expected some of {', '.join(known)}")
    chosen = [known[name] for name in names or known]
    return [log for log in chosen if _is_there(log)]


def _known_logs() -> list[Log]:
    def log(name: str, building: str, file: str, **more: Path) -> Log:
        return Log(name, building, DATA / file, **{"truth": DATA / file, **more})

    freiburg, intel, killian = (
        DATA / f"{name}.relations.gz" for name in ("fr079", "intel", "mit-killian")
    )
    csail = DATA / "mit-csail-corrected.log.gz"
    return [
        log("fr079", "freiburg-079", "fr079.log.gz", relations=freiburg),
        log("fr079-dense", "freiburg-079", "fr079-dense.log.gz"),
        log("intel-lab", "intel", "intel-lab.log.gz", relations=intel),
        log("intel", "intel", "intel.log.gz"),
        log("csail", "csail", "mit-csail.clf.gz", truth=csail),
        log("csail-thinned", "csail", csail.name),
        log("seattle", "seattle", "seattle.log.gz"),
        Log("killian", "killian", KILLIAN, truth=KILLIAN, relations=killian),
    ]


def _is_there(log: Log) -> bool:
    if log.path == KILLIAN:
        fetch_killian()
    if not log.path.is_file():
        print(f"{log.name} left out: there is no {log.path} (MAPWEAVE_DATA names the folder)")
    return log.path.is_file()


def load_scans(log: Log, odometry: str = "none") -> list[Scan]:
    """Return all scans of `log`; with its own odometry ("prior"), or a random walk ("wrong")."""
    scans = list(read_scans(log.path, odometry=odometry == "prior", on_warning=print))
    return wrong_odometry(scans) if odometry == "wrong" else scans


def wrong_odometry(scans: Sequence[Scan]) -> list[Scan]:
    """Return `scans` with odometry that has nothing to do with them: steps of 0.5 m, 0.5 rad."""
    rng = np.random.default_rng(0)
    pose, walked = se2.IDENTITY, []
    for scan in scans:
        pose = se2.compose(pose, rng.normal(0.0, 0.5, 3))
        walked.append(replace(scan, odometry=pose))
    return walked


def load_truth(log: Log, stamps: FloatArray) -> FloatArray:
    """Return (n, 3) corrected laser poses [m, m, rad], NaN where unknown.

    Parameters
    ----------
    stamps
        (n,) of the scans of `log` [s].
    """
    index, pose = read_reference_poses(log.truth)
    truth = np.full((len(stamps), 3), np.nan)
    if log.truth == log.path:
        truth[index] = pose
        return truth
    corrected = np.array([scan.stamp for scan in read_scans(log.truth, on_warning=print)])
    place = {stamp: k for k, stamp in enumerate(stamps)}
    for stamp, row in zip(corrected[index], pose, strict=True):
        truth[place[stamp]] = row
    return truth
