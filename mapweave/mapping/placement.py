"""What became of a scan that a mapper took."""

from dataclasses import dataclass

from mapweave.geometry.arrays import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Placement:
    """What became of a scan.

    Attributes
    ----------
    placed
        Whether it is in the map; one that waits may be placed by a later call.
    component
        The component the robot is in now.
    submap_finished
        Whether this call finished a submap.
    lost
        Whether this call started a new component.
    pose
        (3,) where the scan was taken [m, m, rad], component frame; None where it is not placed.
    uncertainty
        (4,) of it, as of `pose_uncertainty`, component frame; None as well.
    """

    placed: bool
    component: int
    submap_finished: bool
    lost: bool
    pose: FloatArray | None = None
    uncertainty: FloatArray | None = None
