"""A robot: source, mapper, publisher; peers' maps, fusion, alignments.

A program that has scans of its own feeds them to an `Agent`::

    with mapweave_agent.Agent(robot="r1", team="rescue") as agent:
        agent.feed(ranges, angle_min, angle_increment, stamp)
"""

from typing import TYPE_CHECKING

from mapweave.lazy import lazy_names

if TYPE_CHECKING:
    from mapweave_agent.own_agent import Agent

if not TYPE_CHECKING:  # who checks types knows the names from above
    __getattr__, __dir__ = lazy_names(__name__, {"Agent": "mapweave_agent.own_agent"})

__all__ = ["Agent"]
