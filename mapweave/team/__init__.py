"""Many robots: alignments to a joint map."""
