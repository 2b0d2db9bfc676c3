"""Sentences for a person: the one place where reasons become words.

Nothing reads these sentences again; what a program needs to know is in the values.
"""

import re
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from mapweave.reasons import Pair, Reason, ReasonKind, Status, StatusKind

if TYPE_CHECKING:
    from pydantic_core import ErrorDetails

MAX_LENGTH = 500  # characters of a sentence, as many as a message carries

_SENTENCES = {
    ReasonKind.SMALL_REFERENCE: "{reference} has less than {min_wall:g} m of wall to compare",
    ReasonKind.SMALL_OTHER: "{other} has less than {min_wall:g} m of wall to compare",
    ReasonKind.NO_SHAPE: "no part of one has the shape of a part of the other",
    ReasonKind.LITTLE_COMMON: "only {common:.1f} m of wall in common",
    ReasonKind.CONTRADICTED: "{common:.0f} m of wall in common, but {contradictory} m of wall"
    " where the other saw free space",
    ReasonKind.PARALLEL: "{match}; nearly all of it parallel, so one may slide along the other",
    ReasonKind.STRAIGHT: "{match}; but only straight walls, no shape that tells places apart",
    ReasonKind.RIVAL: "{match}; but {elsewhere} fits as well, with {rival_match}",
    ReasonKind.ONE_ROOM: "{match}; without one room {outside:.0f} m of it tell the place: the same"
    " room may exist twice ({sure})",
    ReasonKind.ONE_KIND: "{match}; but both are bare and neither saw more, or doors of one are"
    " walls of the other, or more fits mirrored: the same wing may exist twice ({sure})",
    ReasonKind.UNSURE: "{match}; {next_best}; too little to be sure of the place ({sure})",
    ReasonKind.CONVINCING: "{match}; {next_best}",
    ReasonKind.PARTS_AGREE: "{parts:.0f} pairs of parts agree within {spread:.1f} m; the best held:"
    " {found}",
    ReasonKind.BENT: "{found}; but from there the maps go on for {reach:.0f} m, where they may be"
    " bent by more than {tolerance:g} m: right as a whole with {sure} only",
    ReasonKind.MET_BEFORE: "the robots met before; {found}",
    ReasonKind.FOLLOWED: "by the stored map that one of them follows in; {found}",
    ReasonKind.MIRRORED: "{found}; mirrored, the two have {match}: one of the sensors seems to hang"
    " upside down, or to turn the other way round, and nothing says so",
    ReasonKind.REBASED: "what was compared is in another component by now; to be compared again",
    ReasonKind.OTHERS_CONTRADICT: "{distance:.1f} m and {degrees:.0f}° off what {others}; {found}",
    ReasonKind.MAPS_CONTRADICT: "{witnesses} would have {contradictory} m of wall where the"
    " other saw free space, {common:.0f} m in common; {found}",
    ReasonKind.MAPS_CONTRADICT_JOINTLY: "{witnesses} would have {contradictory} m of wall where"
    " the other saw free space, {common:.0f} m in common, by this alignment or another one between"
    " them; {found}",
    ReasonKind.UNDECIDED: "contradicts others, and nothing tells for sure which is wrong; {found}",
    ReasonKind.PINNED: "pinned by {text}{also}",
    ReasonKind.FORBIDDEN: "forbidden by {text}; {found}",
    ReasonKind.FORBIDDEN_BETWEEN: "would join {witnesses}, forbidden by {text}; {found}",
    ReasonKind.WORDS: "{text}",
}
_MATCH = "{:.0f} m of wall in common, {:.1f} m contradicted"


def counted(number: int, noun: str) -> str:
    """Return a number of things for a person: 1 submap, 2 submaps."""
    return f"{number} {noun}{'' if number == 1 else 's'}"


def in_words(problem: "ErrorDetails") -> str:
    """Return what is wrong with a value of a file or a message, and what was expected.

    Parameters
    ----------
    problem
        As the library found it that checks them.
    """
    said = problem["msg"].removeprefix("Value error, ")
    if problem["type"] == "json_invalid":
        return f"is no JSON, or is cut off (at {said.rpartition(' at ')[2]})"
    whole = {"missing": "is missing", "extra_forbidden": "no such field"}.get(problem["type"])
    return whole or re.sub("^Input should be ", "expected ", said)


def percent(probability: float) -> str:
    """Return a probability for a person; what would round to 100 % is not certain all the same."""
    return "over 99%" if probability >= 0.995 else f"{probability:.0%}"


def tell_reason(cause: Reason, ends: Pair, status: Status | None) -> str:
    """Return the reason of an alignment in one sentence, with what became of it.

    Parameters
    ----------
    cause
        The reason.
    ends
        The alignment's reference and other component.
    status
        In a joint map; None outside, or where nothing became of it.
    """
    told = tell_cause(cause, ends, status)
    if status is None or status.is_relied_on:
        return told
    if status.kind is StatusKind.SET_ASIDE:
        return _shortened(f"set aside: {told}")
    return _shortened(f"revoked in version {status.revoked_in}: {told}")


def tell_cause(cause: Reason, ends: Pair, status: Status | None) -> str:
    """Return the same without what became of it."""
    by = () if status is None else status.set_aside_by
    return _shortened(_SENTENCES[cause.kind].format_map(_words(cause, ends, by)))


def _words(cause: Reason, ends: Pair, by: Sequence[Pair]) -> dict[str, float | str]:
    """Return what the sentences are made of, as far as the kind of `cause` has it."""
    numbers = cause.numbers
    words: dict[str, float | str] = {"reference": ends[0], "other": ends[1], "text": cause.text}
    words |= {"others": _tell_others(by), "witnesses": _tell_witnesses(by)}
    words |= {"next_best": "nothing else fits", "also": ""}
    if "contradicted" in numbers:
        metres = numbers["contradicted"]
        words["contradictory"] = f"{metres:.0f}" if metres >= 10 else f"{metres:.1f}"
        words["match"] = _MATCH.format(numbers["common"], numbers["contradicted"])
    if "confidence" in numbers:
        words["sure"] = percent(numbers["confidence"])
    if "turn" in numbers:
        words["degrees"] = float(np.degrees(numbers["turn"]))
        words["elsewhere"] = _tell_elsewhere(
            numbers["distance"], float(np.degrees(numbers["turn"]))
        )
    if "rival_common" in numbers:
        rival = _MATCH.format(numbers["rival_common"], numbers["rival_contradicted"])
        words |= {
            "rival_match": rival,
            "next_best": f"next best, {words['elsewhere']}, has {rival}",
        }
    if cause.found is not None:
        words["found"] = tell_cause(cause.found, ends, None)
        words["also"] = f"; {words['found']}"
    return {**numbers, **words}


def _tell_elsewhere(distance: float, degrees: float) -> str:
    away = f"{distance:.0f} m away"
    return away if degrees < 9 else f"{away} and turned by {degrees:.0f}°"


def _tell_others(by: Sequence[Pair]) -> str:
    """Return which alignments say otherwise; of many the first and how many more there are."""
    names = ["-".join(pair) for pair in by]
    if len(names) > 3:
        return f"{', '.join(names[:2])} and {len(names) - 2} more say"
    if len(names) < 2:
        return f"{names[0]} says" if names else "others say"
    return f"{', '.join(names[:-1])} and {names[-1]} say"


def _tell_witnesses(by: Sequence[Pair]) -> str:
    return " and ".join(by[0]) if by else "two of the maps"


def shown(text: str, limit: int = 120) -> str:
    """Return what somebody else wrote for a terminal or a log: on one line, and no longer.

    Whatever moves a cursor, begins a line or turns the direction of writing is written as its
    code.
    """
    cut = text[:limit]
    safe = "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in cut)
    return safe if len(safe) <= limit and len(cut) == len(text) else f"{safe[: limit - 1]}…"


def _shortened(sentence: str) -> str:
    return sentence if len(sentence) <= MAX_LENGTH else f"{sentence[: MAX_LENGTH - 1]}…"
