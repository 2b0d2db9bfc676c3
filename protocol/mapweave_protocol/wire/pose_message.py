"""Where a robot is, as a message: small, at the rate of its scans; the next says all that one did.

A robot's own frame is that of its component. Once the joint map has this component, the message
says where the robot is in the joint frame as well, and since which version of the joint map it is
this frame: after a merge, or an un-merge, it changes once.
"""

from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field

from mapweave.geometry.arrays import FloatArray
from mapweave_protocol.wire.model import (
    ComponentName,
    Count,
    Id,
    JointTransform,
    Message,
    Number,
    Transform,
    WireModel,
)

Covariance = Annotated[tuple[Number, ...], Field(min_length=9, max_length=9)]


class JointPose(WireModel):
    """Where a robot is in the joint map.

    Attributes
    ----------
    frame
        The component whose frame the joint frame is.
    since
        The first version of the joint map in which the robot's component was in this frame.
    pose
        [m, m, rad] joint frame.
    covariance
        As of `PoseMessage`, joint frame.
    """

    frame: ComponentName
    since: Count
    pose: JointTransform
    covariance: Covariance


class PoseMessage(Message):
    """Where a robot is.

    Attributes
    ----------
    stamp
        When the scan was taken, as the sensor says; None where it does not.
    sent
        When this was said [s since 1970].
    scan_index
        Of the scan, which counts those that were skipped.
    found
        Whether this scan fitted; where not, all else is as of the last that did.
    component
        The component the robot is in, such as ``r1/0``.
    pose
        [m, m, rad] of the sensor, in the component's frame.
    covariance
        (3, 3) of it by rows [m, m, rad]: of the scan against what was mapped lately. What adds up
        over a path is not in it, nor how well components are joined.
    joint
        The same in the joint frame; None while the joint map does not have the component.
    """

    letter: ClassVar[bytes] = b"p"
    format: ClassVar[str] = "pose"

    robot: Id
    boot: Id
    stamp: Number | None
    sent: Number
    scan_index: Count
    found: bool
    component: ComponentName
    pose: Transform
    covariance: Covariance
    joint: JointPose | None = None


def to_covariance(matrix: FloatArray) -> tuple[float, ...]:
    """Return the ``(3, 3)`` `matrix` by rows, as plain numbers of no more digits than matter."""
    return tuple(float(f"{number:.3g}") for number in np.asarray(matrix).ravel())
