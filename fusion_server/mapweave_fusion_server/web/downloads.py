"""Versions as files: what ``mapweave export`` makes, in a process of its own.

Drawing takes seconds of computing, which the coordinator needs for the map.
"""

import asyncio
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from mapweave.errors import MapweaveError
from mapweave.io.export import EXPORT_SUFFIXES

SUFFIXES = tuple(s for s in (".svg", ".png", ".geojson", ".dxf") if s in EXPORT_SUFFIXES)
TYPES = {
    ".svg": "image/svg+xml",
    ".png": "image/png",
    ".geojson": "application/geo+json",
    ".dxf": "image/vnd.dxf",
}
TIMEOUT = 120.0  # [s]


class ExportFailedError(MapweaveError):
    """A version that could not be made the file that was asked for."""


async def export_version(joint_json: bytes, suffix: str) -> bytes:
    """Return the file that ``mapweave export`` makes of a ``JOINT.json``.

    Raises
    ------
    ExportFailedError
        If it makes none; the text is the line it said.
    """
    with TemporaryDirectory(prefix="mapweave-") as folder:
        source, target = Path(folder, "joint.json"), Path(folder, f"joint{suffix}")
        source.write_bytes(joint_json)
        process = await asyncio.create_subprocess_exec(
            *(sys.executable, "-m", "mapweave", "export", str(source), str(target)),
            stdin=asyncio.subprocess.DEVNULL,
            stdout=asyncio.subprocess.DEVNULL,
            stderr=asyncio.subprocess.PIPE,
        )
        try:
            _, said = await asyncio.wait_for(process.communicate(), TIMEOUT)
        finally:
            if process.returncode is None:
                process.kill()
        if process.returncode != 0:
            lines = said.decode(errors="replace").strip().splitlines() or ["no file was made"]
            raise ExportFailedError(lines[-1].removeprefix("mapweave: "))
        return target.read_bytes()
