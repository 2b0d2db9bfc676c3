"""Settling: what becomes of a submap once it is finished, beside the tracking of the next.

Its component is joined to an older one where shapes prove it, loops are closed, its scans are
refined against each other and against the walls that they saw again, and merged once more along
the better poses. The mapper adopts the outcome when the next submap is finished, at a defined
scan, so a log gives the same map however long settling takes and wherever it runs.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from mapweave import se2
from mapweave.arrays import FloatArray, IntArray
from mapweave.loop_closing import LoopCloser, LoopParameters
from mapweave.maps import LineMap, Submap
from mapweave.observation import Observation
from mapweave.refinement import RefinementParameters, refine
from mapweave.reunion import Reunion, ReunionParameters
from mapweave.submap import GrowingSubmap, SubmapParameters
from mapweave.surface import Surface, join_surfaces, line_surface
from mapweave.uncertainty import EXACT


class SettlingParameters(BaseModel):
    """One model for each stage."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    submap: SubmapParameters = SubmapParameters()
    reunion: ReunionParameters = ReunionParameters()
    loops: LoopParameters = LoopParameters()
    refinement: RefinementParameters = RefinementParameters()
    spacing: float = Field(0.1, gt=0, description="[m] between points on older walls")


@dataclass(frozen=True, slots=True, eq=False)
class Finished:
    """A submap as tracking left it.

    Attributes
    ----------
    submap
        The newest; its id is the count of those before it.
    scans
        The scans of its trajectory, in that order.
    follows
        Whether it was tracked from the submap before it.
    """

    submap: Submap
    scans: tuple[Observation, ...]
    follows: bool


@dataclass(frozen=True, slots=True, eq=False)
class Settled:
    """Where everything is, now that the newest submap is settled.

    Attributes
    ----------
    component
        (n,) of each submap.
    pose
        (n, 3) of each submap in its component's frame [m, m, rad].
    newest
        The last submap, its scans refined and merged again.
    """

    component: IntArray
    pose: FloatArray
    newest: Submap

    def applied(self, submaps: Sequence[Submap]) -> list[Submap]:
        """Return `submaps`, those settled so far, at their new poses."""
        *older, _ = submaps
        placed = [
            replace(s, component=component, pose=pose)
            for s, component, pose in zip(
                older, self.component[:-1].tolist(), self.pose[:-1], strict=True
            )
        ]
        return [*placed, self.newest]


class Settling(Protocol):
    """Settles one submap at a time, here or in another process."""

    def begin(self, finished: Finished) -> None:
        """Take the next submap; the outcome of the one before must have been taken."""

    def take(self) -> Settled | None:
        """Wait for the outcome and return it; None if there is none."""


class Settler:
    """Settles at once, where it is called."""

    def __init__(self, parameters: SettlingParameters) -> None:
        self._parameters = parameters
        self._submaps: list[Submap] = []
        self._reunion = Reunion(parameters.reunion)
        self._breaks: list[int] = []  # ids of submaps that were not tracked from the one before
        self._loops = LoopCloser(parameters.loops)
        self._settled: Settled | None = None

    def begin(self, finished: Finished) -> None:
        """Settle the next submap."""
        self._settled = self.settle(finished)

    def take(self) -> Settled | None:
        """Return the outcome."""
        return self._settled

    def settle(self, finished: Finished) -> Settled:
        """Join, close, refine and merge again."""
        submaps = [*self._submaps, finished.submap]
        if finished.follows and len(submaps) > 1:
            self._loops.graph.track(submaps[-2], submaps[-1])
        elif not finished.follows:
            self._breaks.append(finished.submap.id)
        submaps, joints = self._reunion.reunite(submaps, self._breaks)
        for older, younger in joints:
            self._loops.graph.join(submaps[older], submaps[younger])
        submaps = self._loops.close(submaps)
        newest = self._refined(submaps, finished.scans)
        self._submaps = [*submaps[:-1], newest]
        component = np.array([s.component for s in self._submaps])
        return Settled(component, np.array([s.pose for s in self._submaps]), newest)

    def _refined(self, submaps: Sequence[Submap], scans: Sequence[Observation]) -> Submap:
        """Refine the newest of `submaps` against those it is linked with, and merge it again."""
        p = self._parameters
        newest = submaps[-1]
        linked = [submaps[k] for k in self._loops.graph.neighbours(newest.id)]
        poses = refine(
            [seen.surface for seen in scans],
            newest.trajectory.pose,
            _walls(linked, newest.pose, p.spacing),
            p.refinement,
        )
        growing = GrowingSubmap(p.submap)
        held = newest.trajectory.uncertainty
        uncertainties = np.tile(EXACT, (len(poses), 1)) if held is None else held
        for seen, pose, uncertainty in zip(scans, poses, uncertainties, strict=True):
            growing.add(seen.scan, seen.lines.segments, pose, uncertainty)
        return replace(newest, map=growing.line_map(), trajectory=growing.trajectory())


def _walls(submaps: Sequence[Submap], frame: FloatArray, spacing: float) -> Surface:
    """Return points about every `spacing` [m] on the walls of `submaps`, in `frame` (3,)."""
    surfaces = [line_surface(s.map, spacing)[0].moved(se2.between(frame, s.pose)) for s in submaps]
    return join_surfaces([line_surface(LineMap.empty(), spacing)[0], *surfaces])
