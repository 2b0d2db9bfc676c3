"""Grids that other programs wrote, one module a format."""
