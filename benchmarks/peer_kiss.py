"""Peer: KISS-Matcher (Lim et al. 2025), registration of 3D point clouds; walls extruded in z."""

import math
from types import ModuleType

import numpy as np

from benchmarks.peer_types import Guess, Peer, View
from benchmarks.peer_views import thin
from mapweave.geometry.arrays import FloatArray

THRESHOLD = 5.0  # final inliers from which on its own example calls a registration a success
VOXEL = 0.3  # [m] its default
POINTS_APART = 0.1  # [m] in the clouds it gets, on the plane and in z
HEIGHT = 1.0  # [m] of the walls: does better than 2 m


def kiss_peer(kiss_matcher: ModuleType) -> Peer:
    """Return KISS-Matcher, its configuration the default one but for turns about z alone."""
    configuration = kiss_matcher.KISSMatcherConfig(VOXEL, use_quatro=True)  # turns about z only

    def match(first: FloatArray, second: FloatArray) -> Guess | None:
        matcher = kiss_matcher.KISSMatcher(configuration)
        solution = matcher.solve(*(np.array(found).T for found in matcher.match(second, first)))
        if not solution.valid:
            return None
        turn = math.atan2(solution.rotation[1, 0], solution.rotation[0, 0])
        transform = np.array([*solution.translation[:2], turn], dtype=np.float64)
        return Guess(transform, float(matcher.get_num_final_inliers()))

    return Peer("KISS-Matcher", THRESHOLD, extrude, match)


def extrude(view: View) -> FloatArray:
    """Return (3, n) points of the view's walls [m], as high as a room's."""
    plane = thin(view.walls, POINTS_APART)
    heights = np.arange(0.0, HEIGHT, POINTS_APART)
    return np.vstack([np.repeat(plane.T, len(heights), axis=1), np.tile(heights, len(plane))])
