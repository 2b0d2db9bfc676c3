"""What was found about pairs of maps, told once: again only when the decision or reason changes."""

from collections.abc import Iterator, Set
from dataclasses import dataclass
from typing import TypeAlias

from mapweave.maps import Alignment, Decision, JointMap
from mapweave.reasons import ReasonKind
from mapweave.text import percent, tell_cause
from mapweave_protocol.wire.messages import AlignmentMessage

Runs: TypeAlias = tuple[str, str]  # of the two robots: each numbers its components from 0 again


@dataclass
class _Told:
    """What was told last of a pair.

    Attributes
    ----------
    kinds
        Of the reasons told for this decision, whatever their numbers.
    runs
        None where only the joint map told of it.
    """

    decision: Decision
    kinds: set[ReasonKind]
    runs: Runs | None


class AlignmentStory:
    """Tells decisions with their reasons, and which of them the joint map does not rely on."""

    def __init__(self) -> None:
        self._told: dict[tuple[str, str], _Told] = {}
        self._objections: dict[tuple[str, str], int | None] = {}

    def decided(self, message: AlignmentMessage, past: Set[str]) -> Iterator[str]:
        """Tell each decision that is new, or why a pair is not joined if that is new.

        Nothing is told of components that are `past`: it is no news of anything there is.
        """
        runs = message.reference.boot, message.other.boot
        for alignment in message.unpack():
            if past.isdisjoint({alignment.reference, alignment.other}):
                yield from self._decided(alignment, runs)

    def judged(self, joint: JointMap) -> Iterator[str]:
        """Tell each alignment that `joint` is the first not to rely on, or to rely on again.

        Those that nobody was heard to decide are told as well: who comes late hears why.
        """
        for alignment in joint.alignments:
            pair = alignment.reference, alignment.other
            status = alignment.status
            if status is None or status.is_relied_on:
                yield from self._relied_on_again(alignment)
                if pair not in self._told:
                    yield from self._decided(alignment, None)
            elif self._objections.get(pair, -1) != status.revoked_in:
                revoked = self._objections[pair] = status.revoked_in
                what = f"revoked in version {revoked}" if revoked else "not relied on"
                why = tell_cause(alignment.cause, pair, status)
                yield f"{pair[0]} and {pair[1]}: alignment {what} ({why})"

    def _decided(self, alignment: Alignment, runs: Runs | None) -> Iterator[str]:
        pair, kind = (alignment.reference, alignment.other), alignment.cause.kind
        before = self._told.get(pair)
        if before is not None and before.runs not in (None, runs):
            before = None
        if before is None or before.decision != alignment.decision:
            self._told[pair] = _Told(alignment.decision, {kind}, runs)
            yield _tell(alignment, before.decision if before else None)
            return
        before.runs = runs
        if alignment.decision != "accepted" and kind not in before.kinds:
            before.kinds.add(kind)
            yield _tell(alignment, None)

    def _relied_on_again(self, alignment: Alignment) -> Iterator[str]:
        pair = alignment.reference, alignment.other
        if pair in self._objections:
            del self._objections[pair]
            if alignment.decision == "accepted":
                yield f"{pair[0]} and {pair[1]}: alignment relied on again"


def _tell(alignment: Alignment, before: Decision | None) -> str:
    now = {None: "", "accepted": "no longer accepted, "}.get(before, "now ")
    # That a refused transform is not right needs no figure.
    refused = alignment.decision == "refused"
    sure = "" if refused else f", confidence {percent(alignment.confidence)}"
    names = f"{alignment.reference} and {alignment.other}"
    return f"{names}: {now}{alignment.decision}{sure} ({alignment.reason})"
