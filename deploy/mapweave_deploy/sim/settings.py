"""The built-in worlds: the place, how robots drive in it, and what gets into their sensors' way."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely

from mapweave_deploy.sim.arena import arena
from mapweave_deploy.sim.effects.doors import DoorParameters
from mapweave_deploy.sim.lidars import LIDARS, Lidar
from mapweave_deploy.sim.office import office
from mapweave_deploy.sim.own_body import OwnBodyParameters
from mapweave_deploy.sim.people import PeopleParameters
from mapweave_deploy.sim.places.halls import colonnade, hall, round_rooms
from mapweave_deploy.sim.places.panes import gallery, glass_house
from mapweave_deploy.sim.places.twins import twin_rooms
from mapweave_deploy.sim.places.uneven import ramps
from mapweave_deploy.sim.sweeps import SweepParameters
from mapweave_deploy.sim.trajectories import TourParameters
from mapweave_deploy.sim.world import World, make_world

USUAL, SHORT, PLAIN = TourParameters(), TourParameters(length=30.0), SweepParameters()


@dataclass(frozen=True, slots=True)
class Setting:
    """A built-in world.

    Attributes
    ----------
    about
        For a person, in a few words.
    build
        Makes the place from a seed, as it is on the visit of one robot.
    tours, sweeps
        How robots drive, and what they see beside the place.
    changes
        Whether the place is another on each visit.
    """

    about: str
    build: Callable[[int, int], World]
    tours: TourParameters = USUAL
    sweeps: SweepParameters = PLAIN
    changes: bool = False

    def places(self, seed: int, robots: int) -> tuple[World, list[World]]:
        """Return where robots can drive, and the place as each of so many robots finds it."""
        if not self.changes:
            place = self.build(seed, 0)
            return place, [place] * robots
        places = [self.build(seed, visit) for visit in range(robots)]
        return common_ground(places), places

    def with_lidar(self, lidar: Lidar) -> "Setting":
        """Return the same with another lidar."""
        sweeps = self.sweeps.model_copy(update={"lidar": lidar.parameters})
        rate = lidar.rate or self.tours.scan_rate
        tours = self.tours.model_copy(update={"scan_rate": rate})
        return replace(self, sweeps=sweeps, tours=tours)


def _always(build: Callable[[int], World]) -> Callable[[int, int], World]:
    """Return what makes the same place on every visit."""
    return lambda seed, _visit: build(seed)


SETTINGS: dict[str, Setting] = {
    "office": Setting("corridors, rooms and furniture", _always(office)),
    "arena": Setting("a rescue arena: short oblique walls, rubble", _always(arena), SHORT),
    "crowd": Setting(
        "the office, with people who walk along",
        _always(office),
        sweeps=SweepParameters(people=PeopleParameters(along=3)),
    ),
    "body": Setting(
        "the office, seen by robots that see themselves",
        _always(office),
        sweeps=SweepParameters(body=OwnBodyParameters(width=np.radians(120.0))),
    ),
    "doors": Setting(
        "the office, whose doors are opened and shut",
        _always(office),
        sweeps=SweepParameters(doors=DoorParameters()),
    ),
    "moved": Setting(
        "the office, where each robot finds the furniture moved", office, changes=True
    ),
    "glass": Setting("rooms behind walls of glass", _always(glass_house), SHORT),
    "mirrors": Setting("rooms with mirrors", _always(gallery), SHORT),
    "hall": Setting("a bare hall, and a lidar of short range", _always(hall), SHORT).with_lidar(
        LIDARS["lds"]
    ),
    "colonnade": Setting("a nave between pillars that look alike", _always(colonnade), SHORT),
    "twins": Setting("two rooms that are built alike", _always(twin_rooms)),
    "round": Setting("round rooms", _always(round_rooms), SHORT),
    "ramps": Setting("two levels, a ramp and sills", _always(ramps), SHORT),
}


def common_ground(places: Sequence[World]) -> World:
    """Return the place in which all of `places` are free: there a robot can drive on any visit."""
    free = shapely.intersection_all([place.free for place in places])
    return make_world(places[0].name, free, shapely.Polygon(), places[0].stops)
