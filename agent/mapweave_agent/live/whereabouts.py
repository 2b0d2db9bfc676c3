"""Where the robot is: in its own map, and in the joint map as the coordinator frames it.

Where no coordinator has said so, it is in the frame of the robots it was joined with: of two, that
of the first by name, which both can tell.

No clock and no network in here.
"""

import logging
import math
import threading

import numpy as np

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.mapping.placement import Placement
from mapweave.maps import component_name, parse_component
from mapweave.scan.scan import Scan
from mapweave_protocol.wire.messages import AlignmentMessage, JointStatusMessage, PoseMessage
from mapweave_protocol.wire.model import to_transform
from mapweave_protocol.wire.pairs import name_with_boot, run_of, states_of
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
        # By its boot where another run claims the same component.
        self._names = name_with_boot((robot, boot)), robot
        self._first = first
        self._placement: Placement | None = None
        self._status: JointStatusMessage | None = None
        self._followed: str | None = None  # the coordinator whose frames these are
        self._gone: set[str] = set()
        self._frames = threading.Lock()  # told by one thread, asked by another
        self._since: dict[str, tuple[str, int]] = {}  # own component to joint frame and version
        self._partners: dict[int, dict[str, FloatArray]] = {}  # own component in a partner's frame

    def coordinator(self, status: JointStatusMessage) -> None:
        """Take in which frames the latest joint map has; of two coordinators, the first one's."""
        if status.boot in self._gone or self._followed not in (None, status.boot):
            return
        self._followed = status.boot
        own = {name for name in status.frames if name.rpartition("/")[0] in self._names}
        with self._frames:
            self._status = status
            for name in sorted(own | set(self._since)):
                self._note(name, status)

    def coordinator_here(self, boot: str, *, here: bool) -> None:
        """Note that a coordinator came or went; what it said last stands until another speaks."""
        (self._gone.discard if here else self._gone.add)(boot)
        if self._followed in self._gone:
            self._followed = None

    def met(self, message: AlignmentMessage) -> None:
        """Take in how components of this run lie to those of a partner."""
        if (self._robot, self._boot) not in states_of((message.reference, message.other)):
            return
        for alignment in message.unpack():
            reference, _ = message.ends_of(alignment)
            names = alignment.reference, alignment.other
            to_reference = alignment.transform
            if run_of(reference) == (self._robot, self._boot):
                names, to_reference = names[::-1], se2.inverse(to_reference)
            partner, own = names[0], parse_component(names[1])[1]
            with self._frames:
                frames = self._partners.setdefault(own, {})
                frames.pop(partner, None)
                if alignment.decision == "accepted":
                    frames[partner] = to_reference

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
            joint=self._joint(self._first + last.component, last.pose),
        )

    def _joint(self, number: int, pose: FloatArray) -> JointPose | None:
        with self._frames:
            frames = {} if self._status is None else self._status.frames
            names = (component_name(name, number) for name in self._names)
            name = next((name for name in names if name in frames), None)
            placed = self._in_a_partners_frame(number)
            if name is not None and self._is_told(frames[name].frame, name, placed is not None):
                placed = (*self._since[name], np.array(frames[name].pose))
        if placed is None:
            return None
        frame, since, place = placed
        return JointPose(
            frame=frame,
            since=since,
            pose=to_transform(se2.compose(place, pose)),
        )

    def _is_told(self, frame: str, name: str, joined: bool) -> bool:
        """Tell whether a coordinator's word on a component counts.

        That it is alone is old news where one was joined since the coordinator left.
        """
        return frame != name or self._followed is not None or not joined

    def _in_a_partners_frame(self, number: int) -> tuple[str, int, FloatArray] | None:
        """Return frame, version (none: 0) and pose of an own component that was joined to others'.

        The frame is its own where it is the first of them by name.
        """
        partners = self._partners.get(number)
        if not partners:
            return None
        own = component_name(self._robot, number)
        frame = min([own, *partners], key=parse_component)
        return frame, 0, partners.get(frame, np.zeros(3))

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
            whose = "its own frame again" if frame == name else f"the frame of {frame}"
            if frame != name or known is not None:  # that it begins in its own is no news
                _log.info("%s is in %s from version %d on", name, whose, status.version)


def covariance_of(uncertainty: FloatArray | None) -> FloatArray:
    """Return (3, 3) of (4,) `uncertainty` as of `pose_uncertainty`, in the same frame."""
    covariance = np.zeros((3, 3))
    if uncertainty is not None:
        along, across, heading, direction = uncertainty
        axes = se2.rotation(float(direction))
        covariance[:2, :2] = axes @ np.diag([along**2, across**2]) @ axes.T
        covariance[2, 2] = heading**2
    return covariance
