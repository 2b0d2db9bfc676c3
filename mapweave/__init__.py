"""mapweave: joint line maps of robot teams from raw 2D laser scans.

The library half: arrays in, arrays out; it knows no network and no clock. It implements
*Incremental Multi-Robot Mapping* (Latecki, Lakaemper, Sun, Wolter); "paper" in a docstring
means that text, and roman numerals are its sections.
"""
