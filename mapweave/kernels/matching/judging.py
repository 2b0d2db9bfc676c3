"""What samples of one map's walls find in the raster of another: walls, or space seen through."""

from typing import NamedTuple

import numpy as np

from mapweave.kernels.arrays import BoolArray, Float32Array, FloatArray, Int32Array
from mapweave.kernels.loading import COMPILED


class Samples(NamedTuple):
    """Of a map's walls.

    Attributes
    ----------
    points, normals
        (n, 2) samples [m], and where they face.
    own_depth
        (n,) how deep each lies in the free space of its own map [m].
    """

    points: FloatArray
    normals: FloatArray
    own_depth: Float32Array


class Raster(NamedTuple):
    """The map that they are looked up in.

    Attributes
    ----------
    facing
        (m, 2) where the samples of its walls face.
    nearest, distance, depth
        (rows, columns) the sample nearest to each cell, how far it is [m], and how deep in free
        space the cell lies [m].
    origin, cell
        (2,) its corner [m]; the cells' size [m].
    """

    facing: FloatArray
    nearest: Int32Array
    distance: Float32Array
    depth: Float32Array
    origin: FloatArray
    cell: float


class Limits(NamedTuple):
    """When samples coincide and when they contradict.

    Attributes
    ----------
    closeness, min_cosine
        [m] within which, and of the normals above which, a sample coincides.
    clearance
        [m] of free space beyond which a sample that is not so near was seen through, unless it lies
        as deep in that of its own map.
    """

    closeness: float
    min_cosine: float
    clearance: float


class WeighedMap(NamedTuple):
    """Samples of a map's walls, and the raster that those of another are looked up in.

    Attributes
    ----------
    samples, weight
        And (n,) [m] of wall that each stands for.
    missing
        (n,) what a metre of it counts where it was seen through.
    raster
        Of the same samples.
    """

    samples: Samples
    weight: FloatArray
    missing: FloatArray
    raster: Raster

    @property
    def parts(self) -> tuple[object, ...]:
        """All of it, side by side; the samples face as the raster's do."""
        return (*self.samples, self.weight, self.missing, *self.raster[1:])


class Weighed(NamedTuple):
    """What samples say, summed.

    Attributes
    ----------
    common, contradicted
        [m] of wall that coincides, and that was seen through.
    residual
        [m] median distance of what coincides; infinite where nothing does.
    held
        [m] of what coincides that hold the weakest direction of translation.
    """

    common: float
    contradicted: float
    residual: float
    held: float


def judge_samples_numpy(
    samples: Samples, pose: FloatArray, raster: Raster, limits: Limits
) -> tuple[BoolArray, BoolArray]:
    """Twin of `judge_samples`."""
    return _judged(samples, pose, raster, limits)[:2]


def judge_samples(
    samples: Samples, pose: FloatArray, raster: Raster, limits: Limits
) -> tuple[BoolArray, BoolArray]:
    """Return (n,) which samples coincide with walls, and which were seen through.

    Parameters
    ----------
    pose
        (3,) takes the samples into the raster's frame [m, m, rad].

    Raises
    ------
    ValueError
        Where lengths do not agree.
    """
    if COMPILED is None:
        return judge_samples_numpy(samples, pose, raster, limits)
    coincides, through = COMPILED.judge_samples(*samples, pose, *raster, *limits)
    return coincides.view(np.bool_), through.view(np.bool_)


def weigh_maps_numpy(
    reference: WeighedMap, other: WeighedMap, pose: FloatArray, limits: Limits
) -> tuple[Weighed, Weighed]:
    """Twin of `weigh_maps`."""
    c, s = np.cos(pose[2]), np.sin(pose[2])
    x, y = pose[:2]
    back = np.array([-c * x - s * y, s * x - c * y, -pose[2]])
    return _weighed(other, pose, reference, limits), _weighed(reference, back, other, limits)


def weigh_maps(
    reference: WeighedMap, other: WeighedMap, pose: FloatArray, limits: Limits
) -> tuple[Weighed, Weighed]:
    """Return what the samples of `other` say in `reference`, summed, and the other way round.

    Parameters
    ----------
    pose
        (3,) takes `other` into the frame of `reference` [m, m, rad].

    Raises
    ------
    ValueError
        Where lengths do not agree.
    """
    if COMPILED is None:
        return weigh_maps_numpy(reference, other, pose, limits)
    forward, backward = COMPILED.weigh_maps(*reference.parts, *other.parts, pose, *limits)
    return Weighed(*forward), Weighed(*backward)


def _weighed(walls: WeighedMap, pose: FloatArray, there: WeighedMap, limits: Limits) -> Weighed:
    """Return what the samples of `walls` say in the map `there`, summed."""
    coincides, through, apart = _judged(walls.samples, pose, there.raster, limits)
    common, normals = walls.weight[coincides], walls.samples.normals[coincides]
    scatter = (normals * common[:, None]).T @ normals
    return Weighed(
        float(common.sum()),
        float((walls.weight * walls.missing)[through].sum()),
        float(np.median(apart[coincides].astype(np.float64))) if len(common) else np.inf,
        float(np.linalg.eigvalsh(scatter)[0]),
    )


def _judged(
    samples: Samples, pose: FloatArray, raster: Raster, limits: Limits
) -> tuple[BoolArray, BoolArray, Float32Array]:
    """(n,) which coincide, which were seen through, how far walls are: infinitely, outside."""
    points, normals, own_depth = samples
    if not points.shape == normals.shape == (len(own_depth), 2):
        raise ValueError("points and normals (n, 2), own_depth (n,) expected")
    c, s = np.cos(pose[2]), np.sin(pose[2])
    turn = np.array([[c, s], [-s, c]])
    index = np.floor((points @ turn + pose[:2] - raster.origin) / raster.cell)
    inside = ((index >= 0) & (index < raster.nearest.shape)).all(axis=1)
    i, j = np.where(inside[:, None], index, 0).astype(np.int64).T
    apart = np.where(inside, raster.distance[i, j], np.float32(np.inf))
    near = apart < limits.closeness
    cosine = ((normals @ turn) * raster.facing[raster.nearest[i, j]]).sum(axis=1)
    through = inside & ~near & (raster.depth[i, j] > limits.clearance)
    # What its own map saw through later was no wall for long: it refutes nothing.
    through &= own_depth < limits.clearance
    return near & (cosine > limits.min_cosine), through, apart
