"""Peers: OpenCV's AKAZE and ORB with affine best-of-two matching, the recipe of ROS's map_merge.

Its steps and numbers are those of ``multirobot_map_merge`` (github.com/hrnr/m-explore): default
detectors, `AffineBestOf2NearestMatcher` of four degrees of freedom, whose confidence is
inliers / (8 + 0.3 matches), and joins from a confidence of 1 on.
"""

import math
from dataclasses import dataclass
from types import ModuleType
from typing import Any

import numpy as np

from benchmarks.peer_types import Grid, Guess, Peer, View
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray

THRESHOLD = 1.0  # `estimation_confidence` of map_merge
FULL_AFFINE, GPU, MATCH_CONFIDENCE, LEAST_MATCHES = False, False, 0.3, 6  # OpenCV's defaults
NEAREST = 2  # features that each is matched with: the best of two


@dataclass(frozen=True, slots=True, eq=False)
class Features:
    """The features of one grid, as OpenCV holds them."""

    grid: Grid
    found: Any


def feature_peers(cv2: ModuleType) -> list[Peer]:
    """Return AKAZE and ORB, as this OpenCV has them."""
    return [
        _feature_peer(cv2, "AKAZE (map_merge)", cv2.AKAZE_create()),
        _feature_peer(cv2, "ORB (map_merge)", cv2.ORB_create()),
    ]


def _feature_peer(cv2: ModuleType, name: str, detector: Any) -> Peer:  # noqa: ANN401 - OpenCV's
    def prepare(view: View) -> Features:
        return Features(view.grid, cv2.detail.computeImageFeatures2(detector, view.grid.image))

    def match(first: Features, second: Features) -> Guess | None:
        if min(len(each.found.getKeypoints()) for each in (first, second)) < NEAREST:
            return None  # OpenCV refuses to look for more neighbours than there are
        cv2.setRNGSeed(1)  # its RANSAC: the same every time
        matcher = cv2.detail_AffineBestOf2NearestMatcher(
            FULL_AFFINE, GPU, MATCH_CONFIDENCE, LEAST_MATCHES
        )
        info = matcher.apply(second.found, first.found)
        return None if info.H is None else _guess(info, first, second)

    return Peer(name, THRESHOLD, prepare, match)


def _guess(info: Any, first: Features, second: Features) -> Guess:  # noqa: ANN401 - OpenCV's
    """Return the rigid part of the similarity found; its scale is taken out amid the inliers."""
    turn = math.atan2(info.H[1, 0], info.H[0, 0])
    kept = [m for m, inside in zip(info.getMatches(), info.getInliers(), strict=True) if inside]
    start = _middle(second, [m.queryIdx for m in kept])
    end = _middle(first, [m.trainIdx for m in kept])
    shift = end - se2.rotation(turn) @ start
    return Guess(np.array([*shift, turn]), float(info.confidence))


def _middle(features: Features, chosen: list[int]) -> FloatArray:
    """Return (2,) the mean of the chosen keypoints [m]."""
    keypoints = features.found.getKeypoints()
    pixels = np.array([keypoints[k].pt for k in chosen], dtype=np.float64)
    return np.asarray(features.grid.corner + (pixels.mean(axis=0) + 0.5) * features.grid.cell)
