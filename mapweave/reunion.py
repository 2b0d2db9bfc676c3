"""Lost and found: a robot's components are joined as soon as their shapes prove it (paper, II).

By the means by which two robots' maps are joined: a component is a map like any other.
"""

from collections.abc import Sequence
from dataclasses import replace

from mapweave import se2
from mapweave.assembly import place, unite_lines
from mapweave.fusion import FusionParameters, align_maps
from mapweave.maps import LineMap, Submap


def reunite(
    submaps: Sequence[Submap], parameters: FusionParameters
) -> tuple[list[Submap], list[tuple[int, int]]]:
    """Join every component to an older one where the shapes prove it.

    Returns
    -------
    submaps
        In the same order, with their new components and poses.
    joints
        For each join, the ids of a submap of the older and one of the younger component.
    """
    joined = list(submaps)
    joints: list[tuple[int, int]] = []
    for younger in sorted({s.component for s in submaps})[1:]:
        for older in sorted({s.component for s in joined if s.component < younger}):
            alignment = align_maps(
                ("older", _lines(joined, older)), ("younger", _lines(joined, younger)), parameters
            )
            if alignment.decision == "accepted":
                joints.append((_first(joined, older), _first(joined, younger)))
                joined = [
                    replace(s, component=older, pose=se2.compose(alignment.transform, s.pose))
                    if s.component == younger
                    else s
                    for s in joined
                ]
                break
    return joined, joints


def _first(submaps: Sequence[Submap], component: int) -> int:
    return next(s.id for s in submaps if s.component == component)


def _lines(submaps: Sequence[Submap], component: int) -> LineMap:
    return unite_lines([place(s.map, s.pose) for s in submaps if s.component == component])
