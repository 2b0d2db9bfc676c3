"""Lidars of all kinds, from two-dimensional ones for a hundred euros to those of forklifts."""

from typing import NamedTuple

import numpy as np

from mapweave_deploy.sim.lidar import LidarParameters


class Lidar(NamedTuple):
    """A lidar, and how many scans a second it takes; None where the world tells."""

    parameters: LidarParameters
    rate: float | None = None


def _turn(beams: int) -> float:
    """Return the field of view [rad] of so many beams all round."""
    return 2 * np.pi * (beams - 1) / beams


def _lidar(beams: int, degrees: float, reach: float, noise: float, rate: float) -> Lidar:
    """Return one of so many beams over so many degrees that sees so far [m]."""
    view = np.radians(degrees) if degrees < 360 else _turn(beams)
    parameters = LidarParameters(beams=beams, field_of_view=view, maximum_range=reach, noise=noise)
    return Lidar(parameters, rate)


def _ordered(lidar: Lidar, **changes: object) -> Lidar:
    return lidar._replace(parameters=lidar.parameters.model_copy(update=changes))


_UTM = Lidar(LidarParameters())
LIDARS: dict[str, Lidar] = {
    "utm": _UTM,  # Hokuyo UTM-30LX, grouped by three
    "lms": _lidar(181, 180, 30.0, 0.015, 5.0),  # SICK LMS200
    "tim": _lidar(271, 270, 10.0, 0.02, 15.0),  # SICK TiM561
    "urg": _lidar(682, 239.4, 4.0, 0.02, 10.0),  # Hokuyo URG-04LX
    "lds": _lidar(360, 360, 3.5, 0.015, 5.0),  # TurtleBot's LDS-01
    "rplidar": _ordered(_lidar(360, 360, 8.0, 0.02, 5.5), order="clockwise", dropout=0.05),
    "ld06": _ordered(_lidar(450, 360, 10.0, 0.02, 10.0), order="clockwise", mixed=0.4),
    "upside-down": _ordered(_UTM, order="clockwise"),
    "mirrored": _ordered(_UTM, order="mirrored"),  # upside down, and its driver does not say so
}
