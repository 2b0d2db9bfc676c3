"""Geometry as whole numbers, and these as few bytes."""
