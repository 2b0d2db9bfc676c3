"""Where a robot is, as a message: small, at the rate of its scans; the next says all that one did.

A robot's own frame is that of its component. Once the joint map has this component, the message
says where the robot is in the joint frame as well, and since which version of the joint map it is
this frame: after a merge, or an un-merge, it changes once.
"""

from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave_protocol.wire.budget import KIB, Budget
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

Covariance = Annotated[tuple[Number, ...], Field(min_length=6, max_length=6)]


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
    """

    frame: ComponentName
    since: Count
    pose: JointTransform


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
        Of it, in the component's frame, the upper triangle by rows [m, m, rad]: of the scan against
        what was mapped lately. What adds up over a path is not in it, nor how well components are
        joined. `covariance_matrix` gives it whole, in either frame.
    joint
        The same in the joint frame; None while the joint map does not have the component.
    """

    letter: ClassVar[bytes] = b"p"
    format: ClassVar[str] = "pose"
    budget: ClassVar[Budget] = Budget(16 * KIB, 16 * KIB, 256)

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

    def covariance_matrix(self, *, joint: bool = False) -> FloatArray:
        """Return the ``(3, 3)`` covariance [m, m, rad], in the joint frame where that is asked for.

        Raises
        ------
        ValueError
            If the joint frame is asked for while there is none.
        """
        matrix = np.empty((3, 3))
        matrix[np.triu_indices(3)] = self.covariance
        matrix.T[np.triu_indices(3)] = self.covariance
        if not joint:
            return matrix
        if self.joint is None:
            raise ValueError("the robot is in no joint frame")
        to_joint = np.eye(3)
        to_joint[:2, :2] = se2.rotation(self.joint.pose[2] - self.pose[2])
        return np.asarray(to_joint @ matrix @ to_joint.T)


def to_covariance(matrix: FloatArray) -> tuple[float, ...]:
    """Return the upper triangle of ``(3, 3)`` `matrix`, to the digits that mean anything."""
    return tuple(float(f"{number:.2g}") for number in np.asarray(matrix)[np.triu_indices(3)])
