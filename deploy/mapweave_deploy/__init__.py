"""Launching a team on one machine: the router, the simulated worlds, the processes."""
