"""Simulated worlds, and the logs that robots bring from them."""
