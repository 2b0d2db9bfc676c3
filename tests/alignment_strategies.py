"""Alignments by property: every kind of reason, status and evidence (Hypothesis)."""

import numpy as np
from hypothesis import strategies as st

from mapweave.evidence import Evidence, RunnerUp
from mapweave.maps import Alignment, Decision, SharedPlace
from mapweave.reasons import MAX_DEPTH, Pair, Reason, ReasonKind, Status, StatusKind

NUMBERS = st.floats(-1e6, 1e6)
NAMES = st.sampled_from(["a/0", "b/12", "r-1_x/3"])
PAIRS: st.SearchStrategy[Pair] = st.tuples(NAMES, NAMES)
MATCH = ["common", "contradicted"]
RIVAL = ["distance", "turn", "rival_common", "rival_contradicted"]
NEEDED: dict[ReasonKind, list[list[str]]] = {
    ReasonKind.SMALL_REFERENCE: [["min_wall"]],
    ReasonKind.SMALL_OTHER: [["min_wall"]],
    ReasonKind.NO_SHAPE: [[]],
    ReasonKind.LITTLE_COMMON: [["common"]],
    ReasonKind.CONTRADICTED: [MATCH],
    ReasonKind.PARALLEL: [MATCH],
    ReasonKind.STRAIGHT: [MATCH],
    ReasonKind.RIVAL: [MATCH + RIVAL],
    ReasonKind.ONE_ROOM: [[*MATCH, "outside", "confidence"]],
    ReasonKind.ONE_KIND: [[*MATCH, "confidence"]],
    ReasonKind.UNSURE: [[*MATCH, "confidence"], [*MATCH, "confidence", *RIVAL]],
    ReasonKind.CONVINCING: [MATCH, MATCH + RIVAL],
    ReasonKind.REBASED: [[]],
}
ABOUT_FOUND: dict[ReasonKind, list[str]] = {
    ReasonKind.PARTS_AGREE: ["parts", "spread"],
    ReasonKind.BENT: ["reach", "tolerance", "confidence"],
    ReasonKind.MET_BEFORE: [],
    ReasonKind.FOLLOWED: [],
    ReasonKind.MIRRORED: MATCH,
    ReasonKind.OTHERS_CONTRADICT: ["distance", "turn"],
    ReasonKind.MAPS_CONTRADICT: MATCH,
    ReasonKind.MAPS_CONTRADICT_JOINTLY: MATCH,
    ReasonKind.UNDECIDED: [],
    ReasonKind.PINNED: [],
    ReasonKind.FORBIDDEN: [],
    ReasonKind.FORBIDDEN_BETWEEN: [],
}
ORDERED = {ReasonKind.PINNED, ReasonKind.FORBIDDEN, ReasonKind.FORBIDDEN_BETWEEN}
PRINTABLE = st.text("aé° {}%;…", max_size=40)


@st.composite
def reasons(draw: st.DrawFn) -> Reason:
    """Draw a reason, and what was found before, and before that."""
    kind = draw(st.sampled_from([*NEEDED, ReasonKind.WORDS]))
    if kind is ReasonKind.WORDS:
        reason = Reason.words(draw(PRINTABLE))
    else:
        names = draw(st.sampled_from(NEEDED[kind]))
        reason = Reason(kind, {name: draw(NUMBERS) for name in names})
    for above in draw(st.lists(st.sampled_from(list(ABOUT_FOUND)), max_size=MAX_DEPTH - 1)):
        words = draw(PRINTABLE) if above in ORDERED else ""
        reason = Reason(above, {name: draw(NUMBERS) for name in ABOUT_FOUND[above]}, reason, words)
    return reason


@st.composite
def statuses(draw: st.DrawFn) -> Status:
    """Draw a status of any kind."""
    kind = draw(st.sampled_from(StatusKind))
    by = draw(st.lists(PAIRS, max_size=4).map(tuple))
    if kind is StatusKind.REVOKED:
        return Status(kind, by, draw(st.integers(1, 2**53)))
    return Status(kind, by if kind is StatusKind.SET_ASIDE else ())


def evidences() -> st.SearchStrategy[Evidence]:
    """Return a strategy of evidence of which any part was measured."""
    names = st.sampled_from(list(Evidence.__dataclass_fields__))
    return st.dictionaries(names, NUMBERS).map(Evidence.of)


@st.composite
def places(draw: st.DrawFn) -> SharedPlace:
    """Draw a place where an alignment holds."""
    x, y = draw(st.integers(-9999, 9999)) / 100, draw(st.integers(-9999, 9999)) / 1000
    ids = st.integers(0, 4095)
    return SharedPlace(draw(ids), draw(ids), np.array([y, x, 0.125]), np.array([x, 2.5]))


@st.composite
def alignments(draw: st.DrawFn) -> Alignment:
    """Draw an alignment with all that it may have."""
    decision: Decision = draw(st.sampled_from(["accepted", "ambiguous", "refused"]))
    number = st.none() | NUMBERS
    rival = RunnerUp(np.array([1.0, 2.0, 3.0]), draw(number), draw(number), draw(evidences()))
    return Alignment(
        "a/0",
        "b/12",
        np.array([draw(st.floats(-1e4, 1e4)), 2.0, 0.5]),
        decision,
        draw(st.floats(0, 1)),
        draw(reasons()),
        draw(evidences()),
        draw(st.sampled_from([None, rival])),
        draw(st.none() | statuses()),
        draw(st.lists(places(), max_size=3).map(tuple)),
    )
