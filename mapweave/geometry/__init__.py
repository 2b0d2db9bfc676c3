"""Rigid motions, segments, polygons."""
