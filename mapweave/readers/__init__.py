"""Reading laser logs: the scans, and for benchmarks the poses that came with them."""

from mapweave.readers.log import count_scans, read_scans

__all__ = ["count_scans", "read_scans"]
