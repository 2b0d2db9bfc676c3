"""Shape words of many maps by what they look like, and where a map's words say that it is in them.

Words are `mapweave.shape.words`. They lie in buckets by length and turns, so that looking one up
takes as long among ten thousand maps as among ten, but for what is found; what is found is bounded
by taking the rarest words first.
"""

from typing import NamedTuple, Protocol, cast

import numpy as np
from numpy.typing import NDArray

from mapweave.kernels.arrays import BoolArray, FloatArray, IntArray
from mapweave.kernels.loading import COMPILED

STEPS = 4096  # of a turn that places are told by
FARTHEST = 320.0  # [m] from a map's origin; words beyond are left out
Allowed = NDArray[np.uint8]
Found = tuple[IntArray, FloatArray, FloatArray]


class IndexSettings(NamedTuple):
    """How words are told apart, and which of them agree.

    Attributes
    ----------
    longest
        [m] between the ends of a word.
    length_bin, turn_bins
        [m] and how many of a turn: what words of one bucket share.
    margin
        Share of a bin from whose edge on the next one is looked in as well.
    length_tolerance, turn_tolerance
        [m], [rad] that words which are alike may differ by.
    cell, cell_turns
        [m] and how many of a turn: of the cells votes are counted in, three by three by three.
    """

    longest: float
    length_bin: float
    turn_bins: int
    margin: float
    length_tolerance: float
    turn_tolerance: float
    cell: float
    cell_turns: int


class ShapeIndex(Protocol):
    """What both the compiled class and its twin offer."""

    def __len__(self) -> int:
        """Return how many maps there were."""

    def add(self, words: FloatArray, kind: IntArray) -> int:
        """Take the (n, 6) words of one more map; return its slot, counted from 0."""

    def remove(self, slot: int) -> None:
        """Forget the words of a map; its slot is not given again. ValueError if it has none."""

    def places(
        self,
        words: FloatArray,
        kind: IntArray,
        middle: FloatArray,
        allowed: Allowed,
        budget: int,
        count: int,
        distance: float,
        turn: float,
    ) -> Found:
        """Return slots (c,), transforms (c, 3) to them, and votes (c,): the most voted places.

        Parameters
        ----------
        words, kind
            Of the map that is looked for.
        middle
            (2,) of it [m]: where places are told apart.
        allowed
            (slots,) whether places in a map are wanted.
        budget
            How many words that are alike are looked at, at most: of the rarest.
        count, distance, turn
            How many places, and by what two of one map differ [m], [rad].
        """


def shape_index(settings: IndexSettings) -> ShapeIndex:
    """Return an index of nothing."""
    make = ShapeIndexNumpy if COMPILED is None else COMPILED.ShapeIndex
    return cast("ShapeIndex", make(*settings))


class ShapeIndexNumpy:
    """Twin of the compiled class."""

    def __init__(self, *settings: float) -> None:
        s = IndexSettings(*settings)  # type: ignore[arg-type]
        self._s = s
        self._bin = round(1000 * s.length_bin)
        self._lengths = round(1000 * s.longest) // self._bin + 1
        self._words: list[IntArray] = []
        self._buckets: list[IntArray] = []
        self._alive: list[bool] = []

    def __len__(self) -> int:
        return len(self._alive)

    def add(self, words: FloatArray, kind: IntArray) -> int:
        """See `ShapeIndex`."""
        packed, kind = _packed(words, kind)
        bucket = self._key(*self._bins(packed), kind)
        self._words.append(packed[bucket >= 0])
        self._buckets.append(bucket[bucket >= 0])
        self._alive.append(True)
        return len(self._alive) - 1

    def remove(self, slot: int) -> None:
        """See `ShapeIndex`."""
        if not 0 <= slot < len(self._alive) or not self._alive[slot]:
            raise ValueError("slot: of a map expected")
        self._alive[slot] = False
        if 2 * self._dead() > sum(map(len, self._words)):
            for k in np.flatnonzero(~np.array(self._alive)):
                self._words[k], self._buckets[k] = self._words[k][:0], self._buckets[k][:0]

    def places(
        self,
        words: FloatArray,
        kind: IntArray,
        middle: FloatArray,
        allowed: Allowed,
        budget: int,
        count: int,
        distance: float,
        turn: float,
    ) -> Found:
        """See `ShapeIndex`."""
        if len(allowed) != len(self) or len(self) == 0:
            if len(allowed) == 0:
                return np.empty(0, dtype=np.int64), np.empty((0, 3)), np.empty(0)
            raise ValueError("allowed (slots,) expected")
        packed, kind = _packed(words, kind)
        ours, theirs, slot, weight = self._alike(packed, kind, budget)
        usable = (allowed.astype(np.bool_) & np.array(self._alive))[slot]
        cells, sums = self._votes(
            ours[usable], theirs[usable], slot[usable], weight[usable], middle
        )
        gathered = _gathered(cells, sums, 4 * count, self._s.cell_turns)
        return _best(*gathered, middle, count, distance, turn)

    def _dead(self) -> int:
        return sum(len(w) for w, alive in zip(self._words, self._alive, strict=True) if not alive)

    def _bins(self, packed: IntArray) -> tuple[IntArray, IntArray, IntArray]:
        turns = [(packed[:, k] - packed[:, 2] & 0xFFFF) * self._s.turn_bins >> 16 for k in (3, 4)]
        return packed[:, 5] // self._bin, turns[0], turns[1]

    def _key(self, length: IntArray, first: IntArray, second: IntArray, kind: IntArray) -> IntArray:
        """(n,) bucket of each; -1 where there is none."""
        n = self._s.turn_bins
        key = ((length * n + first % n) * n + second % n) * 4 + kind
        known = (length >= 0) & (length < self._lengths) & (kind >= 0) & (kind <= 3)
        return np.where(known, key, -1)

    def _looked_up(self, packed: IntArray, kind: IntArray) -> tuple[IntArray, IntArray]:
        """Return the (k,) words that look in (k,) buckets."""
        bins = self._bins(packed)
        within = [packed[:, 5] % self._bin / self._bin]
        for k in (3, 4):
            at = (packed[:, k] - packed[:, 2] & 0xFFFF) * self._s.turn_bins & 0xFFFF
            within.append(at / 65536)
        margin = self._s.margin
        side = [np.where(w < margin, -1, np.where(w > 1 - margin, 1, 0)) for w in within]
        words, buckets = [], []
        for m in range(8):
            asked = [(m >> k & 1) * side[k] for k in range(3)]
            wanted = np.all([(side[k] != 0) | (not m >> k & 1) for k in range(3)], axis=0)
            key = self._key(bins[0] + asked[0], bins[1] + asked[1], bins[2] + asked[2], kind)
            words.append(np.flatnonzero(wanted & (key >= 0)))
            buckets.append(key[words[-1]])
        return np.concatenate(words), np.concatenate(buckets)

    def _alike(
        self, packed: IntArray, kind: IntArray, budget: int
    ) -> tuple[IntArray, IntArray, IntArray, FloatArray]:
        """Return (h, 6) words, those found for them, whose they are, and what each votes."""
        held = np.concatenate([np.empty((0, 6), dtype=np.int64), *self._words])
        slots = np.repeat(np.arange(len(self._words)), [len(w) for w in self._words])
        buckets = np.concatenate([np.empty(0, dtype=np.int64), *self._buckets])
        order = np.argsort(buckets, kind="stable")
        both = np.concatenate([packed, _reversed(packed)])
        swapped = (kind & 1) << 1 | kind >> 1
        word, bucket = self._looked_up(both, np.concatenate([kind, swapped]))
        low = np.searchsorted(buckets[order], bucket, "left")
        hits = np.searchsorted(buckets[order], bucket, "right") - low
        found = np.bincount(word % max(len(packed), 1), hits, len(packed)).astype(np.int64)
        ranked = np.argsort(found, kind="stable")
        kept: BoolArray = np.zeros(len(packed), dtype=np.bool_)
        kept[ranked[np.cumsum(found[ranked]) <= budget]] = True
        used = kept[word % max(len(packed), 1)] & (hits > 0)
        word, low, hits = word[used], low[used], hits[used]
        rank = np.arange(hits.sum()) - np.repeat(np.cumsum(hits) - hits, hits)
        at = order[np.repeat(low, hits) + rank]
        asked = np.repeat(word, hits)
        weight = np.log1p(len(held) / found[asked % max(len(packed), 1)])
        return both[asked], held[at], slots[at], weight

    def _votes(
        self,
        ours: IntArray,
        theirs: IntArray,
        slot: IntArray,
        weight: FloatArray,
        middle: FloatArray,
    ) -> tuple[IntArray, FloatArray]:
        """Return (v, 4) cells: slot, x, y, turn, and (v, 5) votes, places and turns, weighted."""
        s = self._s
        turned = _signed(theirs[:, 2] - ours[:, 2])
        one, two = (_signed(theirs[:, k] - ours[:, k] - turned) for k in (3, 4))
        most = round(s.turn_tolerance / (2 * np.pi) * 65536)
        alike = (np.abs(one) <= most) & (np.abs(two) <= most)
        alike &= np.abs(ours[:, 5] - theirs[:, 5]) <= round(1000 * s.length_tolerance)
        ours, theirs, slot, weight = ours[alike], theirs[alike], slot[alike], weight[alike]
        angle = turned[alike] + np.rint((one[alike] + two[alike]) / 3).astype(np.int64)
        step = (angle + 8 >> 4) & (STEPS - 1)
        theta = 2 * np.pi * step / STEPS
        c, sine = np.cos(theta), np.sin(theta)
        dx, dy = (middle - ours[:, :2] / 100).T
        x, y = theirs[:, 0] / 100 + c * dx - sine * dy, theirs[:, 1] / 100 + sine * dx + c * dy
        cells = np.column_stack(
            [slot, np.floor(x / s.cell), np.floor(y / s.cell), step * s.cell_turns // STEPS]
        ).astype(np.int64)
        return cells, weight[:, None] * np.column_stack([np.ones(len(c)), x, y, c, sine])


def _packed(words: FloatArray, kind: IntArray) -> tuple[IntArray, IntArray]:
    """Return words in cm, 1/65536 of a turn and mm, and their kind; those too far away left out."""
    near = np.all(np.isfinite(words) & (np.abs(words) <= FARTHEST), axis=1)
    near &= (words[:, 5] >= 0) & (words[:, 5] <= 65)
    units = np.array([100, 100, *(3 * [65536 / (2 * np.pi)]), 1000])
    packed = np.rint(words[near] * units).astype(np.int64)
    packed[:, 2:5] &= 0xFFFF
    return packed, kind[near]


def _reversed(packed: IntArray) -> IntArray:
    """(n, 6) the same words from their other ends."""
    swapped = packed[:, [0, 1, 2, 4, 3, 5]]
    swapped[:, 2] = packed[:, 2] + 32768 & 0xFFFF
    return swapped


def _signed(angle: IntArray) -> IntArray:
    """(n,) angles in half a turn to either side, in 1/65536 of one."""
    return (angle + 32768 & 0xFFFF) - 32768


def _gathered(
    cells: IntArray, sums: FloatArray, most: int, turns: int
) -> tuple[IntArray, FloatArray]:
    """Return the `most` voted distinct cells (c, 4), and (c, 5) sums with the cells beside them."""
    names, owner = np.unique(cells, axis=0, return_inverse=True)
    own = np.column_stack([np.bincount(owner.ravel(), w, len(names)) for w in sums.T])
    ranked = np.argsort(-own[:, 0], kind="stable")[:most]
    places = {tuple(name): k for k, name in enumerate(names.tolist())}
    total = np.zeros((len(ranked), 5))
    for row, (slot, x, y, turn) in enumerate(names[ranked].tolist()):
        for step in np.ndindex(3, 3, 3):
            beside = x + step[0] - 1, y + step[1] - 1, (turn + step[2] - 1) % turns
            near = places.get((slot, *beside))
            if near is not None:
                total[row] += own[near]
    return names[ranked], total


def _best(
    cells: IntArray,
    sums: FloatArray,
    middle: FloatArray,
    count: int,
    distance: float,
    turn: float,
) -> Found:
    """Return the most voted places of the cells, of which no two of a map are alike."""
    ranked = np.lexsort((*cells.T[::-1], -sums[:, 0]))
    slots, places, votes = list[int](), list[tuple[float, float, float]](), list[float]()
    for k in ranked.tolist():
        x, y = (sums[k, 1:3] / sums[k, 0]).tolist()
        theta = float(np.arctan2(sums[k, 4], sums[k, 3]))
        slot = int(cells[k, 0])
        near = (
            np.hypot(x - a, y - b) <= distance
            and abs((theta - t + np.pi) % (2 * np.pi) - np.pi) <= turn
            for other, (a, b, t) in zip(slots, places, strict=True)
            if other == slot
        )
        if len(slots) == count or any(near):
            continue
        slots.append(slot)
        places.append((x, y, theta))
        votes.append(float(sums[k, 0]))
    placed = np.array(places).reshape(-1, 3)
    c, s = np.cos(placed[:, 2]), np.sin(placed[:, 2])
    turned = np.column_stack([c * middle[0] - s * middle[1], s * middle[0] + c * middle[1]])
    transforms = np.column_stack([placed[:, :2] - turned, placed[:, 2]])
    return np.array(slots, dtype=np.int64), transforms, np.array(votes)
