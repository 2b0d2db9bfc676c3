"""Many sightings to few lines (paper, V to VII)."""
