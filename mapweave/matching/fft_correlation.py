"""Correlation: every shift of a map over another, for the turns at which their walls are parallel.

The two direction histograms (paper, VI-A) leave a few turns open. For each of them the score of
every shift at once is a correlation of rasters: a product in the frequency domain. Unlike shapes
that must be found again, it misses no place where much wall is in common, however broken.

Points and unit normals n are complex numbers, and so are the cells. Two walls that face directions
apart by d count (1 + 2 cos d + cos 2d) / 4: all where they face the same way, nothing where they
are square or back to back. With the contradictions both ways that makes three correlations, each
the real part of Σ a conj(b):

- n / 2 of places near a wall, with n · metres of wall;
- n² / 4 of places near a wall, with n² · metres of wall;
- what a metre of wall counts at a place, + i · metres of wall, of one map with the other way round
  of the other.
"""

from dataclasses import dataclass, replace

import numpy as np
import scipy
from pydantic import Field

from mapweave.geometry.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from mapweave.kernels.matching.marks import (
    Complex64Array,
    Places,
    conjugate_products,
    highest,
    mark_cells,
)
from mapweave.matching.distance_field import DistanceField
from mapweave.parameters import StageParameters, derived

STEP = 2  # every second row and column of a map's raster is fine enough


class FftCorrelationParameters(StageParameters):
    """How fine and how many."""

    cell: float = Field(0.3, gt=0, description="[m] of the rasters: what alignment mends")
    max_size: int = Field(400, ge=16, description="[cells] along both maps; larger get coarser")
    turns: int = Field(4, ge=1, description="the most likely ones; a rectangular building has four")
    shifts: int = Field(50, ge=1, description="handed on for each turn, the best")
    clearance: float = derived(
        lambda c: 5 / 3 * c.mapping.clearance,
        gt=0,
        description="[m] inside seen free space from which a wall contradicts; more than"
        " when it is verified, for the shift and the turn are rough",
    )


@dataclass(frozen=True, slots=True, eq=False)
class Marks:
    """What a map puts into the cells, at complex places x + iy [m].

    Attributes
    ----------
    wall, facing, metres
        (n,) places of wall, their unit normals, and what they stand for [m].
    near, alike
        (m,) places near a wall, and its unit normal.
    seen
        (k,) places deep in the free space that was seen.
    area
        [m²] that each of `near` and `seen` stands for.
    """

    wall: ComplexArray
    facing: ComplexArray
    metres: FloatArray
    near: ComplexArray
    alike: ComplexArray
    seen: ComplexArray
    area: float

    @classmethod
    def of(cls, raster: DistanceField, closeness: float, clearance: float) -> "Marks":
        """Take the marks of `raster`: near walls within `closeness` [m], and deep in free space."""
        normals = _complex(raster.oriented.normals)
        distance, depth = raster.distance[::STEP, ::STEP], raster.depth[::STEP, ::STEP]
        near = distance < closeness
        return cls(
            _complex(raster.oriented.points),
            normals,
            raster.weight,
            _centres(near, raster),
            normals[raster.nearest[::STEP, ::STEP][near]],
            _centres(~near & (depth > clearance), raster),
            (STEP * raster.cell) ** 2,
        )

    def turned(self, turn: float) -> "Marks":
        """Return the marks of the map turned by `turn` [rad] about its origin."""
        by = np.exp(1j * turn)
        turned = {n: getattr(self, n) * by for n in ("wall", "facing", "near", "alike", "seen")}
        return replace(self, **turned)

    @property
    def low(self) -> FloatArray:
        """(2,) least x and y [m]."""
        places = np.concatenate([self.wall, self.near, self.seen])
        return np.array([places.real.min(), places.imag.min()])

    @property
    def span(self) -> FloatArray:
        """(2,) extent in x and y [m]."""
        places = np.concatenate([self.wall, self.near, self.seen])
        return np.array([np.ptp(places.real), np.ptp(places.imag)])


def correlate(
    reference: Marks,
    other: Marks,
    turns: FloatArray,
    weight: float,
    parameters: FftCorrelationParameters,
) -> tuple[FloatArray, FloatArray]:
    """Return (m, 3) transforms from `other` to `reference`: the best shifts at (k,) `turns` [rad].

    And their (m,) scores [m]: `weight` metres in common are outweighed by a metre contradicted.
    """
    if len(turns) == 0:
        return np.empty((0, 3)), np.empty(0)
    p = parameters
    turned = [other.turned(float(turn)) for turn in turns]
    span = reference.span + np.max([marks.span for marks in turned], axis=0)
    cell = max(p.cell, float(span.max()) / p.max_size)
    shape = (
        scipy.fft.next_fast_len(int(span[0] / cell) + 2),
        scipy.fft.next_fast_len(int(span[1] / cell) + 2),
    )
    low, weight = reference.low, weight / 2
    here = _spectra(reference, cell, shape, weight, True)
    found, scores = [], []
    for turn, marks in zip(turns, turned, strict=True):
        there = _spectra(marks, cell, shape, weight, False)
        score = scipy.fft.ifft2(conjugate_products(here, there), overwrite_x=True)
        best = highest(score, p.shifts)
        scores.append(score.real.ravel()[best].astype(np.float64))
        shift = _shifts(best, score.shape, reference.span / cell)
        place = low - marks.low + cell * shift
        found.append(np.column_stack([place, np.full(len(place), turn)]))
    return np.concatenate(found), np.concatenate(scores)


def _shifts(cells: IntArray, shape: tuple[int, ...], size: FloatArray) -> FloatArray:
    """(n, 2) shifts [cells] that `cells`, by number, stand for.

    Those beyond `size` (2,) are negative.
    """
    shift = np.column_stack(np.unravel_index(cells, shape)).astype(np.float64)
    return np.where(shift > size + 1, shift - shape, shift)


def _spectra(
    marks: Marks, cell: float, shape: tuple[int, int], weight: float, first: bool
) -> Complex64Array:
    """(3, rows, columns) of `shape`: the spectra of what `marks` put into cells from their corner.

    A metre of wall counts an eighth where it is near wall, whichever way it faces, so that both
    ways give the quarter; the rest hangs on the normals. Less `weight` where it was seen through.
    Only the cells that the map reaches are laid out: the others are empty.
    """
    places = Places(marks.wall, marks.facing, marks.metres, marks.near, marks.alike, marks.seen)
    used = (int(marks.span[0] / cell) + 1, int(marks.span[1] / cell) + 1)
    cells = mark_cells(places, marks.low, cell, used, marks.area / cell**2, weight, first)
    along = scipy.fft.fft(cells, shape[1], axis=2)
    spectra: Complex64Array = scipy.fft.fft(along, shape[0], axis=1)
    return spectra


def _complex(vectors: FloatArray) -> ComplexArray:
    """(n,) x + iy of (n, 2) vectors."""
    return vectors[:, 0] + 1j * vectors[:, 1]


def _centres(chosen: BoolArray, raster: DistanceField) -> ComplexArray:
    """Where the chosen ones of every STEP-th row and column of `raster` are."""
    centres = raster.origin + raster.cell * (STEP * np.argwhere(chosen) + 0.5)
    return _complex(centres)
