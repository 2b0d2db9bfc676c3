"""Hypothesise, align, verify (paper, VIII)."""
