"""What speaks for and against the poses of a scan: what it and earlier scans saw."""

from typing import NamedTuple, cast

import numpy as np

from mapweave.kernels.loading import COMPILED
from mapweave.kernels.point_map import Bools, Floats, Ints, PointMap
from mapweave.kernels.viewpoints import Viewpoints


class EvidenceSettings(NamedTuple):
    """When a point speaks for or against a pose.

    Attributes
    ----------
    overlap
        [m] within which a known point explains it.
    clearance
        [m] by which seeing through must be certain.
    witnesses
        How many viewpoints are asked, the nearest to the pose.
    sight, far_sight, facing
        [m] up to which a point may be contradicted; the same where its normal is turned towards the
        sensor, by this cosine.
    """

    overlap: float
    clearance: float
    witnesses: int
    sight: float
    far_sight: float
    facing: float


def pose_evidence_numpy(
    known: PointMap,
    viewpoints: Viewpoints,
    points: Floats,
    normals: Floats,
    loose: Bools,
    poses: Floats,
    settings: EvidenceSettings,
) -> Ints:
    """Twin of `pose_evidence`."""
    p = settings
    explained = known.explains(points, normals, poses, p.overlap)
    distance = np.hypot(*points.T)
    ahead = -np.einsum("ij,ij->i", points, normals)
    faced = ahead / np.maximum(distance, 1e-9) > p.facing
    judged = (distance < p.sight) | (faced & (distance < p.far_sight))
    free = viewpoints.free(points, poses, ~explained & judged, p.witnesses, p.clearance)
    against, excused = (free & ~loose).sum(axis=1), (free & loose).sum(axis=1)
    return np.column_stack([explained.sum(axis=1), against, excused])


def pose_evidence(
    known: PointMap,
    viewpoints: Viewpoints,
    points: Floats,
    normals: Floats,
    loose: Bools,
    poses: Floats,
    settings: EvidenceSettings,
) -> Ints:
    """Return (k, 3) how many points speak for each of `poses` (k, 3), and how many against it.

    For it those on known surfaces, against it those where earlier scans saw free space; the last
    column counts those against it that are on loose things, and are left out of the others.

    Parameters
    ----------
    known
        The surfaces seen lately.
    viewpoints
        From where, and what was seen through from there.
    points, normals
        (n, 2) of a scan [m], and unit vectors, sensor frame.
    loose
        (n,) which of them are on things that may have come since.
    poses
        [m, m, rad], frame of `known`.
    settings
        As of `evidence_settings`.
    """
    compute = pose_evidence_numpy if COMPILED is None else COMPILED.pose_evidence
    return cast("Ints", compute(known, viewpoints, points, normals, loose, poses, settings))


def evidence_settings(settings: EvidenceSettings) -> EvidenceSettings:
    """Return `settings` as `pose_evidence` takes them."""
    if COMPILED is None:
        return settings
    return cast("EvidenceSettings", COMPILED.EvidenceSettings(*settings))
