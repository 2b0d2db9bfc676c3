"""Loops closed, and the graph of poses they hang on."""
