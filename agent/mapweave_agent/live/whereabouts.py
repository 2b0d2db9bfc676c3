"""Where the robot is: in its own map, and in the joint map as the coordinator frames it.

No clock and no network in here.
"""

import logging
import math
import threading

import numpy as np

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.mapping.placement import Placement
from mapweave.maps import component_name
from mapweave.scan.scan import Scan
from mapweave_protocol.wire.messages import JointStatusMessage, PoseMessage
from mapweave_protocol.wire.model import to_transform
from mapweave_protocol.wire.pose_message import JointPose, to_covariance

_log = logging.getLogger(__name__)


class Whereabouts:
    """Makes a message of where each scan was taken.

    Parameters
    ----------
    robot, boot
        Of this run.
    first
        The number of the run's first component.
    """

    def __init__(self, robot: str, boot: str, first: int) -> None:
        self._robot = robot
        self._boot = boot
        self._first = first
        self._placement: Placement | None = None
        self._status: JointStatusMessage | None = None
        self._frames = threading.Lock()  # told by one thread, asked by another
        self._since: dict[str, tuple[str, int]] = {}  # own component to joint frame and version

    def coordinator(self, status: JointStatusMessage) -> None:
        """Take in which frames the latest joint map has."""
        own = {name for name in status.frames if name.rpartition("/")[0] == self._robot}
        with self._frames:
            self._status = status
            for name in sorted(own | set(self._since)):
                self._note(name, status)

    def message(self, scan: Scan, placement: Placement, now: float) -> PoseMessage | None:
        """Return where `scan` was taken, or the last one that fitted; None before there was one.

        Parameters
        ----------
        placement
            What became of the scan.
        now
            [s since 1970]
        """
        if placement.pose is not None:
            self._placement = placement
        last = self._placement
        if last is None or last.pose is None:
            return None
        component = component_name(self._robot, self._first + last.component)
        covariance = covariance_of(last.uncertainty)
        return PoseMessage(
            robot=self._robot,
            boot=self._boot,
            stamp=scan.stamp if math.isfinite(scan.stamp) else None,
            sent=round(now, 3),
            scan_index=scan.index,
            found=placement.pose is not None,
            component=component,
            pose=to_transform(last.pose),
            covariance=to_covariance(covariance),
            joint=self._joint(component, last.pose),
        )

    def _joint(self, component: str, pose: FloatArray) -> JointPose | None:
        with self._frames:
            if self._status is None or component not in self._status.frames:
                return None
            place = self._status.frames[component]
            frame, since = self._since[component]
        return JointPose(
            frame=frame,
            since=since,
            pose=to_transform(se2.compose(place.pose, pose)),
        )

    def _note(self, name: str, status: JointStatusMessage) -> None:
        """Note, and say, when the frame that a component is in changes."""
        frame = status.frames[name].frame if name in status.frames else None
        known = self._since.get(name, (None, 0))[0]
        if frame == known:
            return
        if frame is None:
            del self._since[name]
            _log.info("%s is in no joint map from version %d on", name, status.version)
        else:
            self._since[name] = frame, status.version
            _log.info("%s is in the frame of %s from version %d on", name, frame, status.version)


def covariance_of(uncertainty: FloatArray | None) -> FloatArray:
    """Return (3, 3) of (4,) `uncertainty` as of `pose_uncertainty`, in the same frame."""
    covariance = np.zeros((3, 3))
    if uncertainty is not None:
        along, across, heading, direction = uncertainty
        axes = se2.rotation(float(direction))
        covariance[:2, :2] = axes @ np.diag([along**2, across**2]) @ axes.T
        covariance[2, 2] = heading**2
    return covariance
