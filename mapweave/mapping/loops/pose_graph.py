"""A robust pose graph: submap poses that fit the tracking and every loop closure that is true.

Solved by GTSAM's Levenberg-Marquardt under graduated non-convexity (Yang et al. 2020), which
finds the poses and the false closures together: tracking links are trusted, and a closure that
does not fit them and the other closures gets no weight.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mapweave.geometry.arrays import BoolArray, FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Constraint:
    """A measured relative pose.

    Attributes
    ----------
    first, second
        Which poses it links.
    transform
        (3,) of the second in the frame of the first [m, m, rad].
    covariance
        (3, 3) of the transform, in the frame of the second [m², rad²].
    trusted
        Whether it is known to be true, as tracking is.
    """

    first: int
    second: int
    transform: FloatArray
    covariance: FloatArray
    trusted: bool


ANCHOR_SIGMAS = (1e-4, 1e-4, 1e-5)  # [m, m, rad]: a fixed pose stays where it is


def optimise(
    poses: FloatArray, links: Sequence[Constraint], fixed: Sequence[int] = (0,)
) -> tuple[FloatArray, BoolArray]:
    """Return the poses (n, 3) that fit `links` best, and which (k,) links they rely on.

    Parameters
    ----------
    poses
        (n, 3) first guesses. Links must connect all.
    fixed
        Which of them are kept, one at least.
    """
    import gtsam  # here: who only tracks, reads or draws maps need not load the solver

    graph, start = gtsam.NonlinearFactorGraph(), gtsam.Values()
    anchor = gtsam.noiseModel.Diagonal.Sigmas(np.array(ANCHOR_SIGMAS))
    for key, pose in enumerate(poses):
        start.insert(key, gtsam.Pose2(*pose))
    for link in links:
        noise = gtsam.noiseModel.Gaussian.Covariance(link.covariance)
        measured = gtsam.Pose2(*link.transform)
        graph.add(gtsam.BetweenFactorPose2(link.first, link.second, measured, noise))
    for key in fixed:
        graph.add(gtsam.PriorFactorPose2(key, gtsam.Pose2(*poses[key]), anchor))
    parameters = gtsam.GncLMParams()
    trusted = [k for k, link in enumerate(links) if link.trusted]
    parameters.setKnownInliers([*trusted, *range(len(links), len(links) + len(fixed))])
    optimiser = gtsam.GncLMOptimizer(graph, start, parameters)
    values = optimiser.optimize()
    fitted = [values.atPose2(key) for key in range(len(poses))]
    relied_on = np.asarray(optimiser.getWeights())[: len(links)] > 0.5
    return np.array([[p.x(), p.y(), p.theta()] for p in fitted]), relied_on
