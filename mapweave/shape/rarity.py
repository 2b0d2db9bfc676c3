"""Rarity: how much it proves that two maps agree in a shape (paper, VIII, H1, with numbers).

The paper begins with the most complex object, as that is least likely to be elsewhere. How unlikely
is counted here: ends of walls that both maps have, each told by where it lies from another one, in
tangent space, as a shape word is. A word that every building is full of proves little, one that was
hardly ever seen much: it is worth the logarithm of one over its share of all words, in bits. Of all
ways to tell the ends one by the other, the commonest counts, so that an end counts once, however
many pairs it is in and however many scans saw it. A plain rectangle, driven through ten times, has
four ends; ten metres of a laboratory's wall with hooks and niches have ten.
"""

import math
from dataclasses import dataclass

import numpy as np
import scipy
from pydantic import BaseModel, ConfigDict, Field

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray, IntArray
from mapweave.geometry.segments import lengths
from mapweave.shape.background import Counts, Shares


class RarityParameters(BaseModel):
    """When an end of a wall is in both maps, and how finely words are told apart."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    min_length: float = Field(0.5, gt=0, description="[m] of a wall whose ends count")
    same_end: float = Field(
        0.35, gt=0, description="[m] within which ends of one map are of one wall, drawn again"
    )
    distance: float = Field(0.25, gt=0, description="[m] between ends of two maps that are one")
    min_cosine: float = Field(0.94, gt=0, le=1, description="of the angle between their walls: 20°")
    nearest: float = Field(0.5, gt=0, description="[m] between the ends of a word, at least")
    farthest: float = Field(8.0, gt=0, description="[m] between them, at most")
    length_bin: float = Field(
        0.4, gt=0, description="[m] in one bin, about what ends may differ by"
    )
    turn_bins: int = Field(24, ge=3, description="of a turn, likewise: 15°")
    max_ends: int = Field(80, ge=2, description="in common that are counted, of the longest walls")
    left_out: tuple[str, ...] = Field(
        (), description="buildings whose words are not of the background: those measured in"
    )

    @property
    def bins(self) -> int:
        """How many different words there are."""
        lengths_told = int(self.farthest / self.length_bin) + 1
        return lengths_told * self.turn_bins**2 * 4


@dataclass(frozen=True, slots=True, eq=False)
class WallEnds:
    """Ends of the walls of a map, each once, those of the longest walls first.

    Attributes
    ----------
    points
        (n, 2) [m].
    direction
        (n,) of the wall [rad].
    kind
        (n,) 1 where the wall ends, 0 where it begins.
    """

    points: FloatArray
    direction: FloatArray
    kind: IntArray

    def at(self, index: IntArray) -> "WallEnds":
        """Return those at `index`."""
        return WallEnds(self.points[index], self.direction[index], self.kind[index])


def wall_ends(segments: FloatArray, parameters: RarityParameters) -> WallEnds:
    """Return the ends of (n, 4) `segments` x1 y1 x2 y2 [m], the visible side on the left."""
    p = parameters
    length = lengths(segments)
    longest = np.argsort(-length, kind="stable")
    walls = segments[longest[length[longest] >= p.min_length]]
    along = np.arctan2(walls[:, 3] - walls[:, 1], walls[:, 2] - walls[:, 0])
    kind = np.tile(np.arange(2, dtype=np.int64), len(walls))
    ends = WallEnds(walls.reshape(-1, 2), np.repeat(along, 2), kind)
    return ends.at(_first_of_each(ends, p))


def _first_of_each(ends: WallEnds, p: RarityParameters) -> IntArray:
    """Return the places of ends that are not those of a longer wall, drawn again."""
    again = np.zeros(len(ends.points), dtype=np.bool_)
    for i, j in _alike(ends, ends, np.zeros(3), p.same_end, p).tolist():
        if i < j and not again[i]:  # in order: what is drawn again hides nothing
            again[j] = True
    return np.flatnonzero(~again)


def shared_ends(
    ours: WallEnds, theirs: WallEnds, transform: FloatArray, parameters: RarityParameters
) -> WallEnds:
    """Return those of `theirs` that `transform` (3,) lays on an end of `ours`, as theirs.

    No more than are counted, those of the longest walls.
    """
    pairs = _alike(theirs, ours, transform, parameters.distance, parameters)
    return theirs.at(np.unique(pairs[:, 0])[: parameters.max_ends])


def _alike(
    first: WallEnds, second: WallEnds, transform: FloatArray, distance: float, p: RarityParameters
) -> IntArray:
    """(k, 2) pairs of ends, in order, that are near each other and of walls that run alike."""
    if len(first.points) == 0 or len(second.points) == 0:
        return np.empty((0, 2), dtype=np.int64)
    moved = se2.transform_points(transform, first.points)
    trees = scipy.spatial.KDTree(moved), scipy.spatial.KDTree(second.points)
    near = trees[0].query_ball_tree(trees[1], distance)
    i = np.repeat(np.arange(len(moved)), [len(each) for each in near])
    j = np.array([k for each in near for k in each], dtype=np.int64)
    turned = np.cos(first.direction[i] + transform[2] - second.direction[j])
    like = (first.kind[i] == second.kind[j]) & (turned > p.min_cosine)
    return np.column_stack([i[like], j[like]])


def count_words(ends: WallEnds, parameters: RarityParameters) -> Counts:
    """Return how often which word occurs among ends of one map."""
    p = parameters
    if len(ends.points) < 2:
        return Counts.none()
    pairs = scipy.spatial.KDTree(ends.points).query_pairs(p.farthest, output_type="ndarray")
    apart = np.hypot(*(ends.points[pairs[:, 0]] - ends.points[pairs[:, 1]]).T)
    pairs = pairs[(apart > p.nearest) & (apart < p.farthest)]
    return Counts.of(_words(ends, pairs[:, 0], pairs[:, 1], p))


def _words(ends: WallEnds, first: IntArray, second: IntArray, p: RarityParameters) -> IntArray:
    """(n,) the number of the word that each pair is, whichever of the two comes first."""
    between = ends.points[second] - ends.points[first]
    along = np.arctan2(between[:, 1], between[:, 0])
    apart = np.floor(np.hypot(*between.T) / p.length_bin).astype(np.int64)

    def number(one: IntArray, other: IntArray, line: FloatArray) -> IntArray:
        turns = [
            np.rint((ends.direction[k] - line) / (2 * np.pi) * p.turn_bins).astype(np.int64)
            % p.turn_bins
            for k in (one, other)
        ]
        told = (apart * p.turn_bins + turns[0]) * p.turn_bins + turns[1]
        return np.asarray(4 * told + 2 * ends.kind[one] + ends.kind[other])

    return np.minimum(number(first, second, along), number(second, first, along + np.pi))


def rarity(shared: WallEnds, shares: Shares, own: Counts, parameters: RarityParameters) -> float:
    """Return how much it proves that two maps have the ends `shared`: in bits.

    Parameters
    ----------
    shares
        Of words, in the background.
    own
        Of both maps, where words repeat that the background hardly knows, such as a colonnade's.
    """
    p, count = parameters, len(shared.points)
    if count < 2:
        return 0.0
    i, j = (k.astype(np.int64) for k in np.triu_indices(count, 1))
    apart = np.hypot(*(shared.points[i] - shared.points[j]).T)
    used = (apart > p.nearest) & (apart < p.farthest)
    i, j = i[used], j[used]
    words = _words(shared, i, j, p)
    # What both have in common is in either, and no sign that it is elsewhere too.
    elsewhere = own.less(Counts.of(words), 2)
    share = np.maximum(shares.of(words), elsewhere.shares_of(words))
    cost = np.full((count, count), np.inf)
    cost[i, j] = cost[j, i] = -np.log2(share)
    return _least_tree(cost)


def _least_tree(cost: FloatArray) -> float:
    """Return the cost of the cheapest trees that hold together what (n, n) `cost` can.

    What is in `cost` is lost.
    """
    total, left = 0.0, np.full(len(cost), np.inf)
    waiting = np.ones(len(cost), dtype=np.bool_)
    for _ in range(len(cost)):
        k = int(left.argmin())
        least = float(left[k])
        if math.isfinite(least):
            total += least
        else:
            k = int(waiting.argmax())  # the first of another group: it is told by nothing
        waiting[k] = False
        cost[:, k] = left[k] = np.inf  # what is in a tree is not asked for again
        np.minimum(left, cost[k], out=left)
    return total
