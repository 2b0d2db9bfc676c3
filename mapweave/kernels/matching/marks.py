"""What a map puts into the cells that are correlated with another's."""

from typing import NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from mapweave.kernels.arrays import ComplexArray, FloatArray
from mapweave.kernels.loading import COMPILED

Complex64Array = NDArray[np.complex64]


class Places(NamedTuple):
    """Places x + iy [m]: of wall, with unit normals and metres; near walls, with normals; seen."""

    wall: ComplexArray
    facing: ComplexArray
    metres: FloatArray
    near: ComplexArray
    alike: ComplexArray
    seen: ComplexArray


def mark_cells_numpy(
    places: Places,
    low: FloatArray,
    cell: float,
    shape: tuple[int, int],
    part: float,
    weight: float,
    is_reference: bool,
) -> Complex64Array:
    """Twin of `mark_cells`."""
    wall, near, seen = (
        _cells(p, low, cell, shape) for p in (places.wall, places.near, places.seen)
    )
    sums = np.zeros((3, shape[0] * shape[1]), dtype=np.complex64)
    imaginary = 1j if is_reference else 1
    np.add.at(sums[2], wall, (imaginary * places.metres).astype(np.complex64))
    worth = 1 if is_reference else 1j
    np.add.at(sums[2], near, np.full(len(near), worth * 0.125 * part, dtype=np.complex64))
    np.add.at(sums[2], seen, np.full(len(seen), -worth * weight * part, dtype=np.complex64))
    for power in (1, 2):
        if is_reference:
            marks = near, places.alike**power * (part / (2 * power))
        else:
            marks = wall, places.facing**power * places.metres
        np.add.at(sums[power - 1], marks[0], marks[1].astype(np.complex64))
    return sums.reshape(3, *shape)


def mark_cells(
    places: Places,
    low: FloatArray,
    cell: float,
    shape: tuple[int, int],
    part: float,
    weight: float,
    is_reference: bool,
) -> Complex64Array:
    """Return three grids (3, rows, columns) of `shape`; see `mapweave.matching.fft_correlation`.

    The first two hold normals, and normals squared: of the reference those near walls, by their
    parts of a cell and halved, and quartered; of the other those of walls, by their metres. The
    third holds what a metre of wall counts, + i · metres of wall, of the other one the other way
    round.

    Parameters
    ----------
    low
        (2,) the grids' corner [m].
    cell
        [m].
    part
        Of a cell, that each place near a wall, or seen, stands for.
    weight
        What a metre where it was seen through costs.
    """
    if COMPILED is None:
        return mark_cells_numpy(places, low, cell, shape, part, weight, is_reference)
    wall, facing, near, alike, seen = (
        np.ascontiguousarray(values).view(np.float64).reshape(-1, 2)
        for values in (places.wall, places.facing, places.near, places.alike, places.seen)
    )
    sums = COMPILED.mark_cells(
        wall,
        facing,
        places.metres,
        near,
        alike,
        seen,
        low,
        cell,
        *shape,
        part,
        weight,
        is_reference,
    )
    return cast("Complex64Array", sums.view(np.complex64)[..., 0])


def conjugate_products_numpy(here: Complex64Array, there: Complex64Array) -> Complex64Array:
    """Twin of `conjugate_products`."""
    return np.asarray((here * there.conj()).sum(axis=0), dtype=np.complex64)


def conjugate_products(here: Complex64Array, there: Complex64Array) -> Complex64Array:
    """Return (rows, columns) sums of the products of grids (g, ...) with conjugates of others."""
    if COMPILED is None:
        return conjugate_products_numpy(here, there)
    sums = COMPILED.conjugate_products(_as_pairs(here), _as_pairs(there))
    return cast("Complex64Array", sums.view(np.complex64)[..., 0])


def highest_numpy(values: Complex64Array, count: int) -> NDArray[np.int64]:
    """Twin of `highest`."""
    return np.argsort(-values.real.ravel(), kind="stable")[:count].astype(np.int64)


def highest(values: Complex64Array, count: int) -> NDArray[np.int64]:
    """Return (count,) flat numbers of the highest real parts, the highest first, or all."""
    if COMPILED is None:
        return highest_numpy(values, count)
    return cast("NDArray[np.int64]", COMPILED.highest(_as_pairs(values.ravel()), count))


def _as_pairs(values: Complex64Array) -> NDArray[np.float32]:
    """(..., 2) real and imaginary parts."""
    pairs = np.ascontiguousarray(values).view(np.float32)
    return pairs.reshape(*values.shape, 2)


def _cells(
    places: ComplexArray, low: FloatArray, cell: float, shape: tuple[int, int]
) -> NDArray[np.int64]:
    """(n,) flat numbers of the cells that `places` lie in."""
    i = ((places.real - low[0]) / cell).astype(np.int64)
    j = ((places.imag - low[1]) / cell).astype(np.int64)
    return np.asarray(i * shape[1] + j)
