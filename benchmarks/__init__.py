"""Measures mapweave on real logs: ``python -m benchmarks``."""
