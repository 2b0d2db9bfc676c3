"""Maps for other programs."""
