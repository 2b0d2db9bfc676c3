"""MIT Killian Court: 1.3 km of corridors, from the package ``rtb-data`` on PyPI (MIT licence)."""

import os
import shutil
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

CACHE = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "mapweave"
KILLIAN = CACHE / "killian.g2o.zip"
MEMBER = "rtbdata/data/killian.g2o.zip"


def fetch_killian() -> None:
    """Download the log to `KILLIAN` unless it is there; say so when that cannot be done."""
    if not KILLIAN.is_file():
        print("fetching rtb-data (45 MB) from PyPI for the log of Killian Court")
        with tempfile.TemporaryDirectory() as folder:
            _download(Path(folder))


def _download(folder: Path) -> None:
    command = [sys.executable, "-m", "pip", "download", "--quiet", "--no-deps"]
    done = subprocess.run(
        [*command, "--dest", str(folder), "rtb-data"], capture_output=True, text=True, check=False
    )
    wheels = list(folder.glob("*.whl"))
    if done.returncode != 0 or not wheels:
        print(f"rtb-data cannot be had: {(done.stderr.strip() or 'no wheel').splitlines()[-1]}")
        return
    CACHE.mkdir(parents=True, exist_ok=True)
    unfinished = KILLIAN.with_suffix(".part")
    with (
        zipfile.ZipFile(wheels[0]) as wheel,
        wheel.open(MEMBER) as source,
        unfinished.open("wb") as target,
    ):
        shutil.copyfileobj(source, target)
    unfinished.replace(KILLIAN)
