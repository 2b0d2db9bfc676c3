"""Signatures: what of a submap tells where else it may be, without the submap, in how few bytes.

Whoever has all of a submap looks it up among the signatures of others: long walls to a decimetre,
or shape words without their places. Found is a submap that shares 10 m with it. No free space, no
support, and no place is told, so votes alone decide.
"""

import argparse
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache, partial
from itertools import groupby

import numpy as np

from benchmarks.logs import find_logs
from benchmarks.scale.made_up import robots_of
from benchmarks.shape import FIRST, ROBOTS, SHARED, Key, Sample, samples_of, shared_with
from benchmarks.tables import format_table
from mapweave.geometry.arrays import FloatArray, IntArray
from mapweave.geometry.segments import lengths
from mapweave.kernels.matching.shape_index import IndexSettings, shape_index
from mapweave.maps import LineMap, Submap
from mapweave.matching.place_index import PlaceIndex, PlaceIndexParameters
from mapweave.shape.words import ShapeWords, shape_words
from mapweave_protocol.wire.coding import entropy
from mapweave_protocol.wire.coding.line_code import CodedLines, code_lines, main_turn, turned
from mapweave_protocol.wire.geometry import PackedSubmap, SubmapStream

MOST = 200  # [bytes] of a signature
PER_METRE = 10  # a wall to a decimetre
BIN, TURNS = 0.3, 36  # [m], and how many of a turn: of a word that travels without its place
BINS = (int(8.0 / BIN) + 1) * TURNS**2 * 4
MARGIN = 0.3  # of a bin, from whose edge on the next one is looked in as well
WORDS = (32, 64, 100)
Known = tuple[Key, Submap]
Ranking = Callable[[Sample, Sequence[Known]], list[int]]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Say which logs, how they are cut, and how many submaps there are."""
    parser.add_argument("--logs", nargs="+", metavar="NAME", help="which logs (default all)")
    parser.add_argument(
        "--stretches", type=int, nargs="+", default=[8], metavar="N", help="a log is cut into (8)"
    )
    parser.add_argument("--submaps", type=int, default=1000, metavar="N", help="known (1000)")


@dataclass(frozen=True, slots=True)
class Kind:
    """A kind of signature: its name, its size [bytes] by submap, who ranks submaps by it."""

    name: str
    size: Callable[[Submap], int]
    rank: Ranking


def run(options: argparse.Namespace) -> None:
    """Look every submap up by each kind of signature, print the sizes and how many were found."""
    logs, index = find_logs(options.logs), PlaceIndex[Key]()
    samples = [
        sample
        for log in logs
        for count in options.stretches
        for sample in samples_of(log.name, log.building, count, index)
    ]
    fillers = _fillers(options.submaps)
    rows = [_row(kind, samples, fillers, options.submaps) for kind in kinds(samples)]
    head = ["signature", "to be found", "first", f"first {FIRST}", "bytes, median", "most"]
    print(format_table(head, rows))


def kinds(samples: Sequence[Sample]) -> list[Kind]:
    """Return the kinds of signatures that are measured."""
    p = PlaceIndexParameters()
    walls = ByWalls(p, lambda lines: coded_walls(lines, p.words.min_length)[1])
    words = [
        Kind(
            f"{count} {name} words, without places",
            partial(words_size, count),
            ByWords(count, samples, rarest=rarest).rank,
        )
        for count in WORDS
        for name, rarest in (("rarest", True), ("longest", False))
    ]
    return [
        Kind("all of it, votes alone", whole_size, ByWalls(p, lambda lines: lines.segments).rank),
        Kind(
            f"walls of {p.words.min_length} m and more, to a decimetre",
            lambda submap: coded_walls(submap.map, p.words.min_length)[0],
            walls.rank,
        ),
        *words,
    ]


def whole_size(submap: Submap) -> int:
    """[bytes] of a whole submap, coded."""
    return len(SubmapStream().encoder([PackedSubmap.pack(submap)]).finish())


def coded_walls(lines: LineMap, min_length: float) -> tuple[int, FloatArray]:
    """Return the bytes that long walls take to a decimetre, and these (n, 4) as they arrive [m].

    Of too many the longest.
    """
    length = lengths(lines.segments)
    order = np.argsort(-length, kind="stable")
    walls = lines.segments[order[length[order] >= min_length]]
    for count in range(len(walls), -1, -1):
        size, arrived = _coded(walls[:count])
        if size <= MOST:
            return size, arrived
    raise AssertionError("nothing takes more than a signature may")


def _coded(walls: FloatArray) -> tuple[int, FloatArray]:
    none = np.zeros(len(walls), dtype=np.int64)
    turn = main_turn(LineMap(walls, np.arange(len(walls)), none, ()))
    points = turned(walls.reshape(-1, 2), turn) * PER_METRE
    whole = np.rint(points).astype(np.int64).reshape(-1, 4)
    encoder = entropy.encoder()
    code_lines(encoder, CodedLines(turn, whole, none + 1, none), confident=False)
    return len(encoder.finish()), turned(whole.reshape(-1, 2) / PER_METRE, -turn).reshape(-1, 4)


class ByWalls:
    """Ranks submaps by the votes of the words of walls that are told of each."""

    def __init__(self, p: PlaceIndexParameters, told: Callable[[LineMap], FloatArray]) -> None:
        self._p, self._told = p, told
        self._words: dict[int, ShapeWords] = {}

    def rank(self, sample: Sample, known: Sequence[Known]) -> list[int]:
        """Return the places in `known` of those that are voted, the most voted first."""
        p, ours = self._p, sample.shape.words
        index = shape_index(
            IndexSettings(
                *(p.words.farthest, p.length_bin, p.turn_bins, p.margin, p.length_tolerance),
                *(p.turn_tolerance, p.cell, p.cell_turns),
            )
        )
        for _, submap in known:
            words = self._words_of(submap)
            index.add(words.words, words.kind)
        asked = ours.words, ours.kind, ours.middle, np.ones(len(known), dtype=np.uint8)
        slots, _, _ = index.places(*asked, p.budget, p.voted, p.distance, p.turn)
        return list(dict.fromkeys(slots.tolist()))

    def _words_of(self, submap: Submap) -> ShapeWords:
        if id(submap) not in self._words:
            self._words[id(submap)] = shape_words(self._told(submap.map), self._p.words)
        return self._words[id(submap)]


class ByWords:
    """Ranks submaps by how many words they are told to have, each by how few have it.

    Which words are rare is known of the other buildings.
    """

    def __init__(self, count: int, samples: Sequence[Sample], *, rarest: bool) -> None:
        self._count, self._rarest = count, rarest
        self._seen: dict[str, FloatArray] = {}
        for sample in samples:
            seen = self._seen.setdefault(sample.key[0], np.zeros(BINS))
            seen[np.unique(words_of(sample.submap))] += 1

    def rank(self, sample: Sample, known: Sequence[Known]) -> list[int]:
        """Return the places in `known`, those first that most speaks for."""
        elsewhere = np.sum([n for name, n in self._seen.items() if name != sample.key[0]], axis=0)
        told = [self._told(words_of(submap), elsewhere) for _, submap in known]
        word, owner = np.concatenate(told), np.repeat(np.arange(len(told)), list(map(len, told)))
        hit = np.zeros(BINS, dtype=np.bool_)
        hit[_bins(sample.shape.words, beside=True)] = True
        worth = np.log(len(known) / np.bincount(word, minlength=BINS)[word])
        score = np.bincount(owner, worth * hit[word], len(known))
        return [int(k) for k in np.argsort(-score, kind="stable")[:FIRST]]

    def _told(self, words: IntArray, elsewhere: FloatArray) -> IntArray:
        """Return which of the words of a submap, those of its longest walls first, are told."""
        if not self._rarest:
            return words[: self._count]
        return words[np.argsort(elsewhere[words], kind="stable")[: self._count]]


def words_size(most: int, submap: Submap) -> int:
    """[bytes] of so many words of a submap as a set, at the least."""
    count = min(most, len(words_of(submap)))
    ways = math.lgamma(BINS + 1) - math.lgamma(count + 1) - math.lgamma(BINS - count + 1)
    return math.ceil(ways / math.log(2) / 8)


@cache
def words_of(submap: Submap) -> IntArray:
    """Return the different words of a submap, those of the longest walls first."""
    words = shape_words(submap.map.segments, PlaceIndexParameters().words)
    both = _bins(words, beside=False).reshape(2, -1).min(axis=0)
    _, first = np.unique(both, return_index=True)
    return np.asarray(both[np.sort(first)], dtype=np.int64)


def _bins(words: ShapeWords, *, beside: bool) -> IntArray:
    """Return the bins of words from both ends, and those beside whose edges they are near."""
    baseline, first, second, apart = words.words[:, 2:].T
    reversed_kind = (words.kind & 1) << 1 | words.kind >> 1
    ends = (first, second, baseline, words.kind), (second, first, baseline + np.pi, reversed_kind)
    found = []
    for one, other, line, kind in ends:
        turns = [(wall - line) / (2 * np.pi) % 1.0 * TURNS for wall in (one, other)]
        for step in np.ndindex((2, 2, 2) if beside else (1, 1, 1)):
            length, a, b = (
                np.floor(value + aside * (np.rint(value % 1.0) - 0.5) * 2 * MARGIN)
                for value, aside in zip((apart / BIN, *turns), step, strict=True)
            )
            told = ((np.maximum(length, 0) * TURNS + a % TURNS) * TURNS + b % TURNS) * 4 + kind
            found.append(np.minimum(told.astype(np.int64), BINS - 1))
    return np.concatenate(found)


def _fillers(count: int) -> list[Known]:
    """Return submaps of buildings made up, `count` at least."""
    found: list[Known] = []
    for seed in range(count):
        if len(found) >= count:
            break
        for k, robot_map in enumerate(robots_of(seed, ROBOTS)[0]):
            found += [((f"made up {seed}", k, s.id), s) for s in robot_map.submaps]
    return found


def _row(
    kind: Kind, samples: Sequence[Sample], fillers: Sequence[Known], submaps: int
) -> list[str]:
    """Look up all samples of each log that share enough, each among those of other stretches."""
    ranks: list[int | None] = []
    for log, group in groupby(samples, key=lambda s: s.log):
        own = list(group)
        others = [(s.key, s.submap) for s in samples if s.key[0] != own[0].key[0]]
        drawn = np.random.default_rng(1).permutation(len(others))[: max(submaps - len(own), 0)]
        for sample in own:
            there = [s for s in own if s.key[1] != sample.key[1]]
            right = _right(sample, own, there)
            if right:
                known = [*((s.key, s.submap) for s in there), *(others[k] for k in drawn)]
                known += fillers[: max(submaps - len(known), 0)]
                ranked = kind.rank(sample, known)
                ranks.append(next((n for n, k in enumerate(ranked) if k in right), None))
        print(f"{kind.name}: {log} looked up")
    size = [kind.size(sample.submap) for sample in samples]
    found = [sum(r in range(most) for r in ranks) / len(ranks) for most in (1, FIRST)]
    told = [f"{share:.1%}" for share in found]
    return [kind.name, str(len(ranks)), *told, f"{np.median(size):.0f}", str(max(size))]


def _right(sample: Sample, own: Sequence[Sample], there: Sequence[Sample]) -> set[int]:
    """Return the places in `there` of those that share enough with `sample`."""
    shared = shared_with(sample, own)
    known = [k for k, s in enumerate(there) if np.isfinite(s.frame[0])]
    return {k for k, metres in zip(known, shared, strict=False) if metres >= SHARED}
