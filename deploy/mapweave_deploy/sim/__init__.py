"""Simulated worlds, and the logs that robots bring from them."""

from typing import TYPE_CHECKING

from mapweave.lazy import lazy_names

if TYPE_CHECKING:
    from mapweave_deploy.sim.simulation import RobotLog, simulate

_MODULES = {
    "RobotLog": "mapweave_deploy.sim.simulation",
    "simulate": "mapweave_deploy.sim.simulation",
}

if not TYPE_CHECKING:  # who checks types knows the names from above
    __getattr__, __dir__ = lazy_names(__name__, _MODULES)

__all__ = [
    "RobotLog",
    "simulate",
]
