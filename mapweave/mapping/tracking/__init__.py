"""Scans to poses."""
