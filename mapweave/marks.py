"""Marks: labelled points that anyone attaches to what a robot has mapped, such as a victim.

A mark is held by a scan: it lies where it lay as seen from there, whatever becomes of the scan's
submap. So it moves with every correction: loops that are closed, submaps that are refined or cut,
components that are joined or come apart.
"""

from dataclasses import dataclass

from mapweave.geometry.arrays import FloatArray

MAX_LABEL = 64  # characters of a label


@dataclass(frozen=True, slots=True)
class Anchor:
    """What of a robot's map holds on to a place.

    Attributes
    ----------
    submap
        Its id, as it was when something was attached to it.
    scan
        The index of the scan, in whichever submap that is by now; None where the submap has no
        scans: then it is the submap itself.
    """

    submap: int
    scan: int | None


@dataclass(frozen=True, slots=True, eq=False)
class Mark:
    """A mark on a robot's map.

    Attributes
    ----------
    id
        Tells it from all others.
    label
        What is there, such as ``victim``.
    by
        Who says so: the robot's id, or an operator's name.
    time
        When it was said [s since 1970].
    anchor
        What holds it.
    position
        (2,) [m] in the frame of the sensor at the anchor's scan, or else of its submap.
    """

    id: str
    label: str
    by: str
    time: float
    anchor: Anchor
    position: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class PlacedMark:
    """A mark where it lies now.

    Attributes
    ----------
    id, label, by, time
        As of `Mark`.
    component
        The robot's component that it is in, such as ``a/0``.
    position
        (2,) [m] in the frame of whatever it is a mark of: a robot's component, or a joint one.
    """

    id: str
    label: str
    by: str
    time: float
    component: str
    position: FloatArray
