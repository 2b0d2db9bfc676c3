"""Reading laser logs: the scans, and for benchmarks the poses that came with them."""

from mapweave.io.readers.log import count_scans, read_scans
from mapweave.io.readers.reference_poses import read_reference_poses

__all__ = ["count_scans", "read_reference_poses", "read_scans"]
