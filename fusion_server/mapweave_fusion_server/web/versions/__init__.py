"""Versions as the page is told them: whole, or what changed since the one before."""
