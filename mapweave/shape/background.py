"""The background: how often which shape word occurs in buildings, from which no map can be rebuilt.

A histogram for each building that was looked at, made by ``make background``: which pairs of wall
ends there are, not where. What is measured in a building leaves its histogram out.
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from mapweave.geometry.arrays import FloatArray, IntArray

FILE = Path(__file__).with_name("background.npz")
WORDS = 20_000.0  # that the background counts as: what it never saw is not impossible
UNSEEN = 0.5  # of them, that a word which it never saw counts as


@dataclass(frozen=True, slots=True, eq=False)
class Counts:
    """How often which word occurs: (k,) words, ascending, and (k,) counts, none of them 0."""

    words: IntArray
    count: IntArray

    @classmethod
    def none(cls) -> "Counts":
        """Return that of nothing."""
        return cls(np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64))

    @classmethod
    def of(cls, words: IntArray) -> "Counts":
        """Count (n,) `words`."""
        return cls(*np.unique(words, return_counts=True))

    def plus(self, other: "Counts") -> "Counts":
        """Return both together."""
        words, place = np.unique(np.concatenate([self.words, other.words]), return_inverse=True)
        count = np.bincount(place, np.concatenate([self.count, other.count]), len(words))
        return Counts(words, count.astype(np.int64))

    def less(self, other: "Counts", times: int) -> "Counts":
        """Return what is left without so many times another."""
        left = self.count - times * other.count_of(self.words)
        return Counts(self.words[left > 0], left[left > 0])

    def count_of(self, words: IntArray) -> IntArray:
        """(n,) how often each of (n,) `words` occurs."""
        if len(self.words) == 0:
            return np.zeros(len(words), dtype=np.int64)
        at = np.minimum(np.searchsorted(self.words, words), len(self.words) - 1)
        return np.where(self.words[at] == words, self.count[at], 0)

    def shares_of(self, words: IntArray) -> FloatArray:
        """(n,) which part of all words each of (n,) `words` is."""
        return np.asarray(self.count_of(words) / max(int(self.count.sum()), 1))


@dataclass(frozen=True, slots=True, eq=False)
class Shares:
    """Which part of all words each is: (bins,), above 0."""

    share: FloatArray

    @classmethod
    def mean(cls, buildings: Collection[Counts], bins: int) -> "Shares":
        """Return the mean of several buildings, each as large as another; as good as unseen too."""
        seen = np.zeros(bins)
        for counts in buildings:
            seen[counts.words] += counts.count / counts.count.sum() / len(buildings)
        return cls((WORDS * seen + UNSEEN) / (WORDS + UNSEEN * bins))

    def of(self, words: IntArray) -> FloatArray:
        """(n,) of `words`."""
        return np.asarray(self.share[words])


def load_background(file: Path = FILE) -> dict[str, Counts]:
    """Return the histogram of each building by its name, as of `save_background`."""
    with np.load(file) as kept:
        words = {name: kept[name].astype(np.int64) for name in kept.files}
    return {name: Counts(each[0], each[1]) for name, each in words.items()}


def save_background(buildings: Mapping[str, Counts], file: Path = FILE) -> None:
    """Write the histogram of each building."""
    kept = {n: np.stack([c.words, c.count]).astype(np.uint32) for n, c in sorted(buildings.items())}
    np.savez_compressed(file, **kept)  # type: ignore[arg-type]


@lru_cache(16)
def shares_without(left_out: tuple[str, ...], bins: int) -> Shares:
    """Return the background's shares of words, without what was counted in some buildings."""
    known = load_background()
    return Shares.mean([c for name, c in known.items() if name not in left_out], bins)
