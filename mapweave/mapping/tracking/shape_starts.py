"""Where shapes put a scan: polylines of it lie on corresponding ones of the map (paper, V)."""

from collections.abc import Iterator

import numpy as np

from mapweave.geometry.arrays import FloatArray
from mapweave.mapping.tracking.observation import Observation
from mapweave.maps import LineMap
from mapweave.matching.icp import IcpParameters, Target, align
from mapweave.scan.points import points_on_lines
from mapweave.shape.correspondence import CorrespondenceParameters, correspond


def shape_starts(
    seen: Observation,
    known: LineMap,
    spacing: float,
    icp: IcpParameters,
    parameters: CorrespondenceParameters,
) -> Iterator[FloatArray]:
    """Yield poses (3,) where polylines of the scan lie on corresponding ones of the map (V).

    Parameters
    ----------
    seen
        The scan, prepared.
    known
        The map, in the frame of the poses.
    spacing
        [m] between points on the map's lines.
    icp
        How the polylines are aligned to those they correspond to.
    parameters
        When they correspond.
    """
    (oriented, _), moving = points_on_lines(known, spacing), seen.on_lines
    for found in correspond(known, seen.lines, parameters):
        is_partner = np.asarray(found.corresponding.any(axis=1))
        target = Target.of(oriented.at(is_partner[oriented.polyline]), icp)
        fit = align(moving, target, found.transform, icp, None, found.corresponding)
        yield fit.pose
