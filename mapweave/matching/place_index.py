"""One index of shapes: where in many maps a map may be (paper, VIII, H1 and H2; and VI).

Hypothesise by shape, verify by geometry, for all maps at once. The words of a map (`shape.words`)
are looked up in an index of the words of all maps, the rarest first: what is salient is what is
rare in what was seen so far (H1). Words that are alike (H2) vote for places, a map and a rigid
transform. What is voted most is scored by what both saw, walls and free space, and the best is
returned. Neither grows much with the number of maps: what is looked at is bounded, and grows by
less than their root from a thousand on.
"""

from collections.abc import Hashable
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np
from pydantic import Field

from mapweave.geometry.arrays import FloatArray, IntArray
from mapweave.kernels.matching.place_views import Codes, PlaceView, place_view, place_views
from mapweave.kernels.matching.rasters import cell_codes
from mapweave.kernels.matching.shape_index import Found, IndexSettings, shape_index
from mapweave.maps import LineMap
from mapweave.matching.distance_field import DistanceField, DistanceFieldParameters
from mapweave.matching.verification import VerificationParameters
from mapweave.parameters import StageParameters, derived
from mapweave.shape.words import ShapeWords, WordParameters, shape_words

DIRECTIONS = 32  # of walls that views tell apart: 11° each
SEEN_THROUGH = DIRECTIONS + 1  # what a cell says where space was seen through
NOBODY = -1  # owns what was forgotten
Key = TypeVar("Key", bound=Hashable)


class PlaceIndexParameters(StageParameters):
    """How words are told apart, and how much is looked at.

    Chosen on submaps of `csail-thinned`, `fr079` and `seattle` in 6 stretches each, among 1000;
    how many words are looked at and places voted and scored, on six logs in 3 to 8; by what power
    of the maps these grow, on six logs in 4 and 7 among 10,000.
    """

    words: WordParameters = WordParameters()
    length_bin: float = Field(0.15, gt=0, description="[m] in one bucket")
    turn_bins: int = Field(36, ge=3, description="of a turn, in one bucket: 10°")
    margin: float = Field(0.3, ge=0, lt=0.5, description="of a bin, to look in the next as well")
    length_tolerance: float = Field(0.1, gt=0, description="[m] between words that are alike")
    turn_tolerance: float = Field(0.09, gt=0, description="[rad] between those: 5°")
    cell: float = Field(0.25, gt=0, description="[m] that votes are counted in, thrice as wide")
    cell_turns: int = Field(90, ge=3, description="of a turn, likewise: 4°")
    budget: int = Field(8000, ge=1, description="words alike that are looked at, the rarest")
    voted: int = Field(500, ge=1, description="places that are looked at, the most voted")
    stride: int = Field(5, ge=1, description="of the samples these are scored by at first")
    scored: int = Field(30, ge=1, description="of them that are scored by all samples, the best")
    usual: int = Field(1000, ge=1, description="maps that these three are for, or fewer")
    growth: float = Field(0.4, ge=0, le=1, description="power of the maps by which they grow")
    distance: float = Field(0.35, gt=0, description="[m] between different places of one map")
    turn: float = Field(0.1, gt=0, description="[rad] between those: 6°")
    raster: DistanceFieldParameters = derived(
        lambda c: DistanceFieldParameters.of(
            c, cell=2 * c.mapping.resolution, same_wall=0.5, max_cells=250_000
        )
    )
    verification: VerificationParameters = derived(
        lambda c: VerificationParameters.of(c, contradiction_weight=2.0)
    )
    samples: int = Field(60, ge=10, description="of a map's walls that a place is scored by")


@dataclass(frozen=True, slots=True, eq=False)
class PlaceShape:
    """A map as it is looked up and looked in: made once."""

    words: ShapeWords
    view: PlaceView


@dataclass(frozen=True, slots=True, eq=False)
class Place(Generic[Key]):
    """Where a map may be.

    Attributes
    ----------
    key
        Which map it may be in.
    transform
        (3,) from the map that was looked for to that one [m, m, rad].
    score
        [m] of wall in common less wall contradicted, by few samples.
    votes
        Of words that are alike, each by how rare it is.
    """

    key: Key
    transform: FloatArray
    score: float
    votes: float


class PlaceIndex(Generic[Key]):
    """Maps by their shapes, built as they come."""

    def __init__(self, parameters: PlaceIndexParameters | None = None) -> None:
        self._p = p = parameters or PlaceIndexParameters()
        self._words = shape_index(
            IndexSettings(
                *(p.words.farthest, p.length_bin, p.turn_bins, p.margin, p.length_tolerance),
                *(p.turn_tolerance, p.cell, p.cell_turns),
            )
        )
        self._views = place_views()
        self._slots: dict[Key, int] = {}
        self._keys: list[Key | None] = []
        self._owners: dict[Hashable, int] = {}
        self._owner: IntArray = np.full(64, NOBODY)  # of each slot, and room for more
        self._table = _worth(p.verification)

    def __len__(self) -> int:
        return len(self._slots)

    def __contains__(self, key: Key) -> bool:
        return key in self._slots

    def prepare(self, lines: LineMap) -> PlaceShape:
        """Return what looking `lines` up takes, and adding them; they have a segment at least."""
        words = shape_words(lines.segments, self._p.words)
        return PlaceShape(words, _view(lines, self._p))

    def add(self, key: Key, shape: PlaceShape, owner: Hashable = None) -> None:
        """Take a map in; one of that name before is forgotten.

        Parameters
        ----------
        owner
            Whose it is, such as a robot.
        """
        self.discard(key)
        slot = self._words.add(shape.words.words, shape.words.kind)
        self._slots[key] = slot
        self._keys.append(key)
        self._views.add(shape.view)
        if slot >= len(self._owner):
            self._owner = np.concatenate([self._owner, np.full(len(self._owner), NOBODY)])
        self._owner[slot] = self._owners.setdefault(owner, len(self._owners))

    def discard(self, key: Key) -> None:
        """Forget a map, if it is known."""
        slot = self._slots.pop(key, None)
        if slot is not None:
            self._words.remove(slot)
            self._views.remove(slot)
            self._keys[slot] = None
            self._owner[slot] = NOBODY

    def query(self, shape: PlaceShape, count: int = 5, *, but: Hashable = None) -> list[Place[Key]]:
        """Return at most `count` places where `shape` may be, those that most speaks for first.

        Parameters
        ----------
        but
            Whose maps are not looked in, unless it is None.
        """
        p, (slots, transforms, votes) = self._p, self._voted(shape, but)
        # By few samples first: what is voted most is many times what is worth a closer look.
        looked_at = p.stride, round(p.scored * self._more()), count
        best, scores = self._views.best(shape.view, slots, transforms, self._table, *looked_at)
        named = [(self._keys[slots[k]], k, score) for k, score in zip(best, scores, strict=True)]
        return [
            Place(key, transforms[k], float(score), float(votes[k]))
            for key, k, score in named
            if key is not None
        ]

    def _voted(self, shape: PlaceShape, but: Hashable) -> Found:
        """Return slots, transforms and votes of the places that words say."""
        p, words = self._p, shape.words
        owner = self._owner[: len(self._keys)]
        left_out = NOBODY if but is None else self._owners.get(but, NOBODY)
        allowed = (owner != NOBODY) & (owner != left_out)
        more = self._more()
        return self._words.places(
            *(words.words, words.kind, words.middle, allowed.astype(np.uint8)),
            *(round(p.budget * more), round(p.voted * more), p.distance, p.turn),
        )

    def _more(self) -> float:
        """How many times as much is looked at as among the usual number of maps.

        Among more maps more words are alike by chance, and the right place is voted by fewer of
        those looked at. What both saw tells it as before, once it is among those scored.
        """
        return float(max(len(self) / self._p.usual, 1.0) ** self._p.growth)


def _view(lines: LineMap, p: PlaceIndexParameters) -> PlaceView:
    """Hold the walls and the free space of `lines` ready, in coarse cells and few samples."""
    field = DistanceField.of(lines, p.raster)
    stride = 1 + (len(field.weight) - 1) // p.samples
    weight = field.weight[::stride] * (field.weight.sum() / field.weight[::stride].sum())
    samples = field.oriented.points[::stride], field.facing[::stride], weight
    return place_view(_codes(field, p.verification), field.origin, field.cell, *samples)


def _codes(field: DistanceField, p: VerificationParameters) -> Codes:
    """(rows, columns) what each cell says: a row of `_worth`."""
    cells = field.nearest, field.distance, field.depth, field.facing
    return cell_codes(*cells, p.closeness, p.clearance, DIRECTIONS)


def _worth(p: VerificationParameters) -> FloatArray:
    """(codes, directions) what a metre of wall counts, by what the cell says and its direction."""
    turn = 2 * np.pi / DIRECTIONS * np.arange(DIRECTIONS)
    worth = np.zeros((SEEN_THROUGH + 1, DIRECTIONS))
    worth[:DIRECTIONS] = np.cos(turn[:, None] - turn) > p.min_cosine
    worth[SEEN_THROUGH] = -p.contradiction_weight
    return worth
