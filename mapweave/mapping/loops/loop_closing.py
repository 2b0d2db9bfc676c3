"""Closing loops: a finished submap is found in the robot's older ones.

The engine is fusion's, hypothesise and verify, with one difference: drift is slow, so the true
pose is near the one believed. Every pose within the drift that may have come together since is a
hypothesis; what both submaps saw decides.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from pydantic import Field

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.mapping.loops.pose_graph import Constraint
from mapweave.mapping.loops.submap_graph import SubmapGraph, SubmapGraphParameters
from mapweave.maps import LineMap, Submap
from mapweave.matching.distance_field import DistanceField, DistanceFieldParameters
from mapweave.matching.hypotheses import HypothesisParameters, different
from mapweave.matching.icp import Fit, IcpParameters, Target, align
from mapweave.matching.verification import Verdict, VerificationParameters, coarse_scores, verify
from mapweave.parameters import StageParameters, derived


class LoopParameters(StageParameters):
    """Where closures are looked for and what they must show."""

    graph: SubmapGraphParameters = SubmapGraphParameters()
    raster: DistanceFieldParameters = derived(DistanceFieldParameters.of)
    verification: VerificationParameters = derived(VerificationParameters.of)
    hypotheses: HypothesisParameters = derived(
        lambda c: HypothesisParameters.of(c, count=3, distance=0.6)
    )
    icp: IcpParameters = derived(
        lambda c: IcpParameters.of(c, start_scale=0.4, end_scale=2.5 * c.sensor.range_sigma)
    )
    candidates: int = Field(8, ge=1, description="older submaps compared, the nearest")
    reach: float = derived(
        lambda c: c.mapping.submap_length,
        gt=0,
        description="[m] between the middles of submaps compared",
    )
    drift: float = Field(0.02, gt=0, description="[m/m] of path, the most that is expected")
    min_drift: float = Field(0.6, gt=0, description="[m] searched at the least")
    max_drift: float = Field(4.0, gt=0, description="[m] searched at the most")
    turn_drift: float = Field(0.002, gt=0, description="[rad/m] of path, the most expected")
    min_turn: float = Field(0.06, gt=0, description="[rad] searched at the least")
    max_turn: float = Field(0.26, gt=0, description="[rad] searched at the most: 15°")
    step: float = Field(0.3, gt=0, description="[m] between hypotheses")
    turn_step: float = Field(0.03, gt=0, description="[rad] between hypotheses")
    remembered: int = Field(64, ge=1, description="submaps kept ready to be compared")
    max_samples: int = Field(150, ge=10, description="of a submap's walls, scoring hypotheses")
    min_common: float = Field(6.0, gt=0, description="[m] of wall in common")
    min_overlap: float = Field(0.85, gt=0, le=1, description="share in common of what both saw")
    min_held: float = Field(2.0, gt=0, description="[m] of common wall across any direction")
    max_rival: float = Field(0.75, gt=0, description="score of the next best pose, as a share")
    residual: float = derived(
        lambda c: 7.5 * c.sensor.range_sigma,
        gt=0,
        description="[m] of one wall sample against the pose: far above a laser's, because samples"
        " of one wall err together; so that a closure's sigma is what closures err by against"
        " the corrected poses of five logs (median 0.04-0.07 m, 0.3-0.7°)",
    )
    min_sigma: float = Field(0.02, gt=0, description="[m] no closure is better than that")
    min_turn_sigma: float = Field(0.003, gt=0, description="[rad] no closure is better")


@dataclass(frozen=True, slots=True, eq=False)
class SubmapMatch:
    """An older submap and the newest one.

    Attributes
    ----------
    older
        The older one.
    raster
        Of its lines, in its frame.
    verdict
        What both saw, at the best pose within the drift.
    link
        Of the two, where that proves one.
    """

    older: Submap
    raster: DistanceField
    verdict: Verdict
    link: Constraint | None


class LoopCloser:
    """Finds the newest submap in the older ones, and keeps all of them where they fit."""

    def __init__(self, parameters: LoopParameters) -> None:
        self._parameters = parameters
        self.graph = SubmapGraph(parameters.graph)
        # By the lines, which are the same object as long as they are the same lines.
        self._seen = lru_cache(parameters.remembered)(self._prepare)

    def close(
        self, submaps: Sequence[Submap], compared: Sequence[SubmapMatch] | None = None
    ) -> list[Submap]:
        """Return `submaps` at the poses that fit all links, and those of the last one to others.

        Parameters
        ----------
        compared
            What comparing the last one came to, if that is known.
        """
        found = self.compare(submaps) if compared is None else compared
        return self.graph.close(submaps, [c.link for c in found if c.link is not None])

    def compare(self, submaps: Sequence[Submap]) -> list[SubmapMatch]:
        """Look for the last of `submaps` in the older ones about where it is believed to be."""
        p = self._parameters
        *older, newest = submaps
        if len(newest.map.segments) == 0:
            return []
        paths = self.graph.lengths_from(newest.id, len(submaps))
        here = middle_of_path(newest)
        near = [
            (distance, path, s)
            for s, path in zip(older[:-1], paths, strict=False)
            if s.component == newest.component
            and len(s.map.segments)
            and (distance := math.dist(middle_of_path(s), here)) < p.reach + _drift(path, p)
        ]
        nearest = sorted(near, key=lambda item: item[0])[: p.candidates]
        return [self.compare_two(s, newest, path) for _, path, s in nearest]

    def compare_two(self, older: Submap, newest: Submap, path: float) -> SubmapMatch:
        """Compare two submaps, `path` [m] of tracked path apart; what both saw may prove a link."""
        p = self._parameters
        (reference, target), (other, _) = self._seen(older.map), self._seen(newest.map)
        believed = se2.between(older.pose, newest.pose)
        middle = other.middle
        starts = _around(believed, middle, path, p)
        scores = coarse_scores(reference, other, starts, p.max_samples, p.verification)
        leaders = different(starts, scores, middle, p.hypotheses)
        fits = [align(other.oriented, target, starts[k], p.icp) for k in leaders]
        verdicts = [verify(reference, other, fit.pose, p.verification) for fit in fits]
        poses = np.array([fit.pose for fit in fits])
        ranked = different(poses, np.array([v.score for v in verdicts]), middle, p.hypotheses)
        fit, best = fits[ranked[0]], verdicts[ranked[0]]
        if not _proves([verdicts[k] for k in ranked], p):
            return SubmapMatch(older, reference, best, None)
        link = Constraint(older.id, newest.id, fit.pose, _covariance(fit, p), False)
        return SubmapMatch(older, reference, best, link)

    def _prepare(self, lines: LineMap) -> tuple[DistanceField, Target]:
        raster = DistanceField.of(lines, self._parameters.raster)
        return raster, Target.of(raster.oriented, self._parameters.icp)


def middle_of_path(submap: Submap) -> FloatArray:
    """(2,) middle of a submap's path, component frame [m]."""
    return se2.transform_points(submap.pose, submap.trajectory.pose[:, :2].mean(axis=0))


def _drift(path: float, p: LoopParameters) -> float:
    """[m] that a pose may have drifted on a tracked path [m]."""
    return min(max(p.min_drift, p.drift * path), p.max_drift)


def _around(believed: FloatArray, middle: FloatArray, path: float, p: LoopParameters) -> FloatArray:
    """(k, 3) every pose within the drift of `path` [m] about the `believed` one.

    Turns are about `middle` (2,), the middle of what is turned, so that they do not shift it.
    """
    reach = _drift(path, p)
    turn = min(max(p.min_turn, p.turn_drift * path), p.max_turn)
    shifts = np.linspace(-reach, reach, 2 * int(np.ceil(reach / p.step)) + 1)
    turns = np.linspace(-turn, turn, 2 * int(np.ceil(turn / p.turn_step)) + 1)
    dx, dy, dt = (a.ravel() for a in np.meshgrid(shifts, shifts, turns, indexing="ij"))
    place = se2.transform_points(believed, middle) + np.column_stack([dx, dy])
    angle = believed[2] + dt
    c, s = np.cos(angle), np.sin(angle)
    turned = np.column_stack([c * middle[0] - s * middle[1], s * middle[0] + c * middle[1]])
    poses: FloatArray = np.column_stack([place - turned, se2.wrap(angle)])
    return poses


def _proves(ranked: Sequence[Verdict], p: LoopParameters) -> bool:
    """Whether the best verdict is good enough, and the next far enough behind."""
    best = ranked[0]
    rival = max((v.score for v in ranked[1:]), default=0.0)
    return (
        best.common >= p.min_common
        and best.overlap >= p.min_overlap
        and best.held >= p.min_held
        and rival <= p.max_rival * best.score
    )


def _covariance(fit: Fit, p: LoopParameters) -> FloatArray:
    """(3, 3) covariance of a closure, in the frame of the newer submap."""
    turn = np.eye(3)
    turn[:2, :2] = se2.rotation(fit.pose[2])
    information = turn.T @ fit.information @ turn / p.residual**2 + 1e-6 * np.eye(3)
    floor = np.diag([p.min_sigma**2, p.min_sigma**2, p.min_turn_sigma**2])
    return np.asarray(np.linalg.inv(information) + floor)
