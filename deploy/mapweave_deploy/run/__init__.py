"""A team as processes on this machine."""
