"""Reading laser logs: the scans, and for benchmarks the poses that came with them."""

from mapweave.io.readers.reference_poses import read_reference_poses
from mapweave.io.readers.scans import count_scans, read_scans

__all__ = ["count_scans", "read_reference_poses", "read_scans"]
