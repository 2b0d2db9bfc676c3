"""Where a robot is in a map that is known already: found by shape, followed by tracking."""
