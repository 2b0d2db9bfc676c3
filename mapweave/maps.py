"""The maps: submaps, robot maps, alignments and joint maps, as immutable values.

Words and formats: a *segment* is directed, its visible side on the left of its direction; a
*submap* has a frame of its own; a *component* is a set of submaps whose relative pose is known.
"""

import itertools
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from importlib.metadata import version
from typing import Literal

import numpy as np

from mapweave.config import Config
from mapweave.errors import InvalidComponentError
from mapweave.evidence import Evidence, RunnerUp
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray, IntArray
from mapweave.marks import Mark, PlacedMark
from mapweave.orders import Order
from mapweave.reasons import Reason, Status
from mapweave.text import tell_reason

Decision = Literal["accepted", "ambiguous", "refused"]


@dataclass(frozen=True, slots=True)
class MadeWith:
    """What a map was made with.

    Attributes
    ----------
    program
        Its name and version, such as ``mapweave 0.1.0``.
    config
        The effective configuration, section by section: plain values, as the program had them.
    """

    program: str
    config: Mapping[str, Mapping[str, object]]

    @classmethod
    def of(cls, config: Config) -> "MadeWith":
        """Return what tells of this program under `config`."""
        return cls(f"mapweave {version('mapweave')}", config.values())


@dataclass(frozen=True, slots=True, eq=False)
class Trajectory:
    """The poses of the scans of a submap, in its frame.

    Attributes
    ----------
    scan_index
        (m,) which scan of the log, from 0.
    stamp
        (m,) [s]; NaN where unknown.
    pose
        (m, 3) sensor poses [m, m, rad].
    uncertainty
        (m, 4) how well determined each was when it was placed, against what was mapped lately, and
        by what was not known of the way since something held the robot last: standard deviations of
        the position in the direction that was held least [m], across it [m], and of the heading
        [rad]; and that direction [rad], in (-pi/2, pi/2]. Zeros where a pose was given and not
        found, as that of the first scan. None where it is not known, as in
        maps from the network.
    """

    scan_index: IntArray
    stamp: FloatArray
    pose: FloatArray
    uncertainty: FloatArray | None = None

    @classmethod
    def empty(cls) -> "Trajectory":
        """Return a trajectory of no scans."""
        return cls(np.empty(0, dtype=np.int64), np.empty(0), np.empty((0, 3)))

    @property
    def length(self) -> float:
        """[m] of path, straight from scan to scan."""
        return float(np.hypot(*np.diff(self.pose[:, :2], axis=0).T).sum())


@dataclass(frozen=True, slots=True, eq=False)
class LineMap:
    """Directed segments in one frame, grouped into generalized polylines (paper, V).

    Attributes
    ----------
    segments
        (n, 4) x1 y1 x2 y2 [m], the visible side on the left; polyline by polyline, in their order.
    polyline
        (n,) to which generalized polyline each belongs: 0, 0, 1, 1, 1, 2, … ascending.
    support
        (n,) how many scans saw each.
    free_space
        Simple polygons, each (k, 2) [m], first vertex not repeated, without holes: what was seen
        through. They may overlap.
    """

    segments: FloatArray
    polyline: IntArray
    support: IntArray
    free_space: tuple[FloatArray, ...] = ()

    @classmethod
    def empty(cls) -> "LineMap":
        """Return a map of nothing."""
        return cls(np.empty((0, 4)), np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64))

    @classmethod
    def union(cls, line_maps: "Sequence[LineMap]") -> "LineMap":
        """Return all lines and free space of `line_maps`, which share a frame, side by side."""
        if not line_maps:
            return cls.empty()
        if len(line_maps) == 1:
            return line_maps[0]
        counts = [int(m.polyline[-1]) + 1 if len(m.polyline) else 0 for m in line_maps]
        offsets = itertools.accumulate(counts[:-1], initial=0)
        return cls(
            np.concatenate([m.segments for m in line_maps]),
            np.concatenate([m.polyline + k for m, k in zip(line_maps, offsets, strict=True)]),
            np.concatenate([m.support for m in line_maps]),
            tuple(ring for m in line_maps for ring in m.free_space),
        )

    def moved(self, pose: FloatArray) -> "LineMap":
        """Return this map, given in the frame at `pose` (3,), in that frame's parent."""
        corners = np.concatenate([self.segments.reshape(-1, 2), *self.free_space])
        moved = se2.transform_points(pose, corners)  # all at once
        ends = list(itertools.accumulate(map(len, self.free_space), initial=2 * len(self.segments)))
        rings = tuple([moved[a:b] for a, b in itertools.pairwise(ends)])
        return LineMap(moved[: ends[0]].reshape(-1, 4), self.polyline, self.support, rings)

    @property
    def polylines(self) -> list[FloatArray]:
        """The (k, 4) segments of each generalized polyline."""
        starts = np.flatnonzero(np.diff(self.polyline)) + 1
        return np.split(self.segments, starts) if len(self.segments) else []


@dataclass(frozen=True, slots=True, eq=False)
class Submap:
    """What a robot mapped over a stretch of its path, in a frame of its own.

    Attributes
    ----------
    id
        Counts a robot's submaps from 0.
    component
        Submaps of one component have a known relative pose.
    pose
        (3,) of the submap's frame in the component's [m, m, rad].
    map
        Lines and free space, submap frame.
    trajectory
        Of the scans mapped here, submap frame.
    joined
        (n,) how sure each wall is, where it is a component of a joint map; None of what was mapped.
    """

    id: int
    component: int
    pose: FloatArray
    map: LineMap
    trajectory: Trajectory
    joined: FloatArray | None = None


@dataclass(frozen=True, slots=True, eq=False)
class RobotMap:
    """A robot's submaps with their poses.

    Attributes
    ----------
    robot
        The robot's id.
    boot
        Names this run of the robot; another run starts from nothing.
    version
        Grows with every change.
    submaps
        Ids ascending.
    made_with
        The program and its configuration; None where it is not known, as in maps from the network.
    marks
        What was marked on it.
    """

    robot: str
    boot: str
    version: int
    submaps: tuple[Submap, ...]
    made_with: MadeWith | None = None
    marks: tuple[Mark, ...] = ()

    @property
    def components(self) -> list[int]:
        """The component numbers in use, ascending."""
        return sorted({submap.component for submap in self.submaps})

    def lines(self, component: int) -> LineMap:
        """Return all submaps of `component` in its frame, not merged."""
        return lines_of(s for s in self.submaps if s.component == component)


@dataclass(frozen=True, slots=True, eq=False)
class SharedPlace:
    """A place that two components saw: there an alignment is exact, however bent the maps are.

    Attributes
    ----------
    reference, other
        The ids of a submap of each component.
    transform
        (3,) from the frame of `other` to that of `reference` [m, m, rad]: it stays, whatever
        becomes of the submaps' poses.
    at
        (2,) the middle of the wall that both saw, frame of the alignment's reference [m].
    """

    reference: int
    other: int
    transform: FloatArray
    at: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Alignment:
    """A rigid transform between two components, with its evidence.

    Attributes
    ----------
    reference, other
        Component names such as ``a/0``: component 0 of robot a.
    transform
        (3,) takes coordinates in `other` to coordinates in `reference` [m, m, rad].
    decision
        Accepted, ambiguous or refused.
    confidence
        Probability that the transform is right within 0.5 m and 5° where both looked.
    cause
        Why it was decided so: a kind and its numbers.
    evidence
        The numbers behind the decision.
    runner_up
        The best *different* hypothesis, where there is any.
    status
        What became of it in a joint map; None outside, and of what never was accepted.
    places
        Where it holds, those with the most wall in common first. Beyond, maps are bent.
    """

    reference: str
    other: str
    transform: FloatArray
    decision: Decision
    confidence: float
    cause: Reason
    evidence: Evidence = field(default_factory=Evidence)
    runner_up: RunnerUp | None = None
    status: Status | None = None
    places: tuple[SharedPlace, ...] = ()

    @property
    def reason(self) -> str:
        """One sentence for a person: the cause, and what became of it."""
        return tell_reason(self.cause, (self.reference, self.other), self.status)


@dataclass(frozen=True, slots=True, eq=False)
class JointComponent:
    """Robots' components whose relative poses are known, merged into one line map.

    Attributes
    ----------
    robots
        Component name to its (3,) pose in the joint component's frame [m, m, rad].
    confidence
        That all of it hangs together rightly: of the weakest link needed.
    map
        The merged lines and the free space.
    segment_confidence
        (n,) for each segment of `map`, in [0, 1].
    marks
        Of its robots, in its frame.
    """

    robots: Mapping[str, FloatArray]
    confidence: float
    map: LineMap
    segment_confidence: FloatArray
    marks: tuple[PlacedMark, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class JointMap:
    """What the team knows, as a numbered immutable version.

    `made_with` is None where it is not known, as in maps from the network; `orders` are those of
    operators that were not taken back.
    """

    version: int
    components: tuple[JointComponent, ...]
    alignments: tuple[Alignment, ...]
    made_with: MadeWith | None = None
    orders: tuple[Order, ...] = ()


def component_name(robot: str, component: int) -> str:
    """Return the name of a robot's component, such as ``a/0``."""
    return f"{robot}/{component}"


def parse_component(name: str) -> tuple[str, int]:
    """Return the robot and the number of the component called `name`, such as ``a/0``.

    Raises
    ------
    InvalidComponentError
        If it is no such name.
    """
    robot, slash, number = name.rpartition("/")
    if not robot or not slash or not (number.isascii() and number.isdigit()):
        raise InvalidComponentError(name)
    return robot, int(number)


def lines_of(submaps: Iterable[Submap]) -> LineMap:
    """Return the lines of `submaps` of one component in its frame, not merged."""
    return LineMap.union([s.map.moved(s.pose) for s in submaps])


def submaps_by_component(maps: Iterable[RobotMap]) -> dict[str, list[Submap]]:
    """Return the submaps of every component of `maps`, by its name."""
    return {
        component_name(m.robot, c): [s for s in m.submaps if s.component == c]
        for m in maps
        for c in m.components
    }
