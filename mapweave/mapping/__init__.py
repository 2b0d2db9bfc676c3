"""One robot: scans to submaps."""
