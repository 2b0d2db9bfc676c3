"""Shape whatever its position (paper, VIII-A, B): similarity, complexity, parts in polylines."""

from typing import TYPE_CHECKING

from mapweave.lazy import lazy_names

if TYPE_CHECKING:
    from mapweave.shape.partial_match import PartialMatch, best_match
    from mapweave.shape.tangent_space import NoShapeError, complexity, similarity

_MODULES = {
    "NoShapeError": "mapweave.shape.tangent_space",
    "PartialMatch": "mapweave.shape.partial_match",
    "best_match": "mapweave.shape.partial_match",
    "complexity": "mapweave.shape.tangent_space",
    "similarity": "mapweave.shape.tangent_space",
}

if not TYPE_CHECKING:  # who checks types knows the names from above
    __getattr__, __dir__ = lazy_names(__name__, _MODULES)

__all__ = [
    "NoShapeError",
    "PartialMatch",
    "best_match",
    "complexity",
    "similarity",
]
