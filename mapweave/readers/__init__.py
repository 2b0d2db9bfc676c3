"""Reading laser logs: the scans, and for benchmarks the poses that came with them."""

from mapweave.readers.log import count_scans, read_scans
from mapweave.readers.reference import read_reference_poses

__all__ = ["count_scans", "read_reference_poses", "read_scans"]
