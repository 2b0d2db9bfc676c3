"""A robot: source, mapper, publisher; peers' maps, fusion, alignments."""
