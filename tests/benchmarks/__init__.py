"""Measures mapweave on real logs: ``python -m tests.benchmarks``."""
