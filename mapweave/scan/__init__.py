"""What one scan says: its segments (paper, V), what it saw through, its oriented points."""

from typing import TYPE_CHECKING

from mapweave.lazy import lazy_names

if TYPE_CHECKING:
    from mapweave.scan.scan import Scan
    from mapweave.scan.segmentation import ScanSegments, SegmentationParameters, extract_segments

_MODULES = {
    "Scan": "mapweave.scan.scan",
    "ScanSegments": "mapweave.scan.segmentation",
    "SegmentationParameters": "mapweave.scan.segmentation",
    "extract_segments": "mapweave.scan.segmentation",
}

if not TYPE_CHECKING:  # who checks types knows the names from above
    __getattr__, __dir__ = lazy_names(__name__, _MODULES)

__all__ = [
    "Scan",
    "ScanSegments",
    "SegmentationParameters",
    "extract_segments",
]
