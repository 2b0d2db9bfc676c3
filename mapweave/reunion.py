"""Lost and found: a robot's components are joined as soon as their shapes prove it (paper, II).

By the means by which two robots' maps are joined: a component is a map like any other.
"""

from collections.abc import Sequence
from dataclasses import replace

from mapweave import se2
from mapweave.assembly import place, unite_lines
from mapweave.fusion import FusionParameters, align_maps
from mapweave.maps import LineMap, Submap


def reunite(submaps: Sequence[Submap], parameters: FusionParameters) -> tuple[Submap, ...]:
    """Return `submaps` with every component joined to an older one where the shapes prove it."""
    joined = tuple(submaps)
    for younger in sorted({s.component for s in submaps})[1:]:
        for older in sorted({s.component for s in joined if s.component < younger}):
            alignment = align_maps(
                ("older", _lines(joined, older)), ("younger", _lines(joined, younger)), parameters
            )
            if alignment.decision == "accepted":
                joined = tuple(
                    replace(s, component=older, pose=se2.compose(alignment.transform, s.pose))
                    if s.component == younger
                    else s
                    for s in joined
                )
                break
    return joined


def _lines(submaps: Sequence[Submap], component: int) -> LineMap:
    return unite_lines([place(s.map, s.pose) for s in submaps if s.component == component])
