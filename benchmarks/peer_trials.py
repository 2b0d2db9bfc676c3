"""The peers at work: what each makes of a pair of views, judged as mapweave's alignments are."""

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from benchmarks.coverage import metres_in_common
from benchmarks.pairs import RIGHT_DISTANCE, RIGHT_TURN, Pair
from benchmarks.peer_types import Guess, Peer, View
from benchmarks.stretches import alignment_error
from mapweave.commands.progress import track


@dataclass(frozen=True, slots=True)
class Trial:
    """What one peer made of one pair.

    Attributes
    ----------
    peer, first, second
        Their names.
    common
        [m] of wall that both views saw.
    crosses
        Whether they are of different buildings.
    score
        Of the peer's guess; None where it made none.
    distance, turn
        How far off it is [m], [rad]; None where there is no guess or no truth.
    right
        Whether that is within 0.5 m and 5°.
    seconds
        That it took, the preparation of both views included.
    """

    peer: str
    first: str
    second: str
    common: float
    crosses: bool
    score: float | None
    distance: float | None
    turn: float | None
    right: bool
    seconds: float


def try_peer(
    peer: Peer, views: Mapping[str, View], pairs: Sequence[tuple[str, str]]
) -> list[Trial]:
    """Let `peer` guess every one of `pairs`, which are names in `views`; judge each guess."""
    prepared, seconds = {}, {}
    for name in sorted({name for pair in pairs for name in pair}):
        start = time.perf_counter()
        prepared[name] = peer.prepare(views[name])
        seconds[name] = time.perf_counter() - start
    trials = []
    for a, b in track(pairs, peer.name, len(pairs)):
        start = time.perf_counter()
        guess = peer.match(prepared[a], prepared[b])
        taken = time.perf_counter() - start + seconds[a] + seconds[b]
        trials.append(judge(peer.name, views[a], views[b], guess, taken))
    return trials


def judge(peer: str, first: View, second: View, guess: Guess | None, seconds: float) -> Trial:
    """Return the trial: how far off the guess is at the median over the second view's walls."""
    crosses = first.log.building != second.log.building
    common = 0.0 if crosses else metres_in_common(first.cells, second.cells)
    distance, turn, right = None, None, False
    if guess is not None and not crosses:
        distance, turn = alignment_error(first.part, second.part, guess.transform)
        right = distance <= RIGHT_DISTANCE and turn <= RIGHT_TURN
    score = None if guess is None else guess.score
    return Trial(
        peer, first.name, second.name, common, crosses, score, distance, turn, right, seconds
    )


def trial_of(pair: Pair) -> Trial:
    """Return mapweave's comparison of two stretches as a trial: score 1 where it joined them."""
    right = pair.outcome == "joined right"
    score = 1.0 if right or pair.outcome == "joined wrong" else None
    return Trial(
        "mapweave",
        pair.first,
        pair.second,
        pair.common,
        pair.crosses,
        score,
        None,
        None,
        right,
        pair.seconds,
    )
