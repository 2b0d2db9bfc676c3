"""Two maps to an alignment, with its decision and confidence."""
