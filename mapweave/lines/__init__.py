"""Many sightings to few lines (paper, V to VII): polylines, directions, merging."""

from typing import TYPE_CHECKING

from mapweave.lazy import lazy_names

if TYPE_CHECKING:
    from mapweave.lines.directions import DirectionParameters, main_directions
    from mapweave.lines.merging_cost import CostWeights, merge_cost, merged_segment
    from mapweave.lines.polylines import generalized_polylines

_MODULES = {
    "CostWeights": "mapweave.lines.merging_cost",
    "DirectionParameters": "mapweave.lines.directions",
    "generalized_polylines": "mapweave.lines.polylines",
    "main_directions": "mapweave.lines.directions",
    "merge_cost": "mapweave.lines.merging_cost",
    "merged_segment": "mapweave.lines.merging_cost",
}

if not TYPE_CHECKING:  # who checks types knows the names from above
    __getattr__, __dir__ = lazy_names(__name__, _MODULES)

__all__ = [
    "CostWeights",
    "DirectionParameters",
    "generalized_polylines",
    "main_directions",
    "merge_cost",
    "merged_segment",
]
