"""Why an alignment is as it is, and what became of it, as values; `text` puts them into words."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Self, TypeAlias

Pair: TypeAlias = tuple[str, str]
"""Two components by name, such as ``("a/0", "b/0")``."""

MAX_DEPTH = 8  # of reasons about reasons; the deepest that is made has five


class ReasonKind(StrEnum):
    """What was found about two maps, or about what was found about them."""

    SMALL_REFERENCE = "small_reference"  # too little wall to compare
    SMALL_OTHER = "small_other"
    NO_SHAPE = "no_shape"  # no part of one has the shape of a part of the other
    LITTLE_COMMON = "little_common"
    CONTRADICTED = "contradicted"  # too much wall where the other saw free space
    PARALLEL = "parallel"  # not held along the walls
    STRAIGHT = "straight"  # no shape that tells places apart
    RIVAL = "rival"  # fits as well
    ONE_ROOM = "one_room"  # all that is shared lies in one room, which may exist twice
    ONE_KIND = "one_kind"  # two maps, nearly the same and bare: of one place, or of two built alike
    UNSURE = "unsure"
    CONVINCING = "convincing"

    PARTS_AGREE = "parts_agree"  # these say more about what was found
    BENT = "bent"  # the place is right, the maps as wholes may not be
    MET_BEFORE = "met_before"
    FOLLOWED = "followed"  # of a stored map that one of the robots only follows in
    MIRRORED = "mirrored"  # they would fit if one were mirrored

    REBASED = "rebased"  # what was compared is in another component by now

    OTHERS_CONTRADICT = "others_contradict"  # these object to what was found
    MAPS_CONTRADICT = "maps_contradict"
    MAPS_CONTRADICT_JOINTLY = "maps_contradict_jointly"  # it, or another one on the way
    UNDECIDED = "undecided"

    PINNED = "pinned"  # an operator says that it is right
    FORBIDDEN = "forbidden"  # an operator says that it is wrong
    FORBIDDEN_BETWEEN = "forbidden_between"  # it would join others of which one says so

    WORDS = "words"  # a sentence, of a program that gave no more


_MATCH = ("common", "contradicted")
_RIVAL = ("distance", "turn", "rival_common", "rival_contradicted")
_NUMBERS: dict[ReasonKind, tuple[str, ...]] = {
    ReasonKind.SMALL_REFERENCE: ("min_wall",),
    ReasonKind.SMALL_OTHER: ("min_wall",),
    ReasonKind.LITTLE_COMMON: ("common",),
    ReasonKind.CONTRADICTED: _MATCH,
    ReasonKind.PARALLEL: _MATCH,
    ReasonKind.STRAIGHT: _MATCH,
    ReasonKind.RIVAL: (*_MATCH, *_RIVAL),
    ReasonKind.ONE_ROOM: (*_MATCH, "outside", "confidence"),
    ReasonKind.ONE_KIND: (*_MATCH, "confidence"),
    ReasonKind.UNSURE: (*_MATCH, "confidence"),
    ReasonKind.CONVINCING: _MATCH,
    ReasonKind.PARTS_AGREE: ("parts", "spread"),
    ReasonKind.BENT: ("reach", "tolerance", "confidence"),
    ReasonKind.MIRRORED: _MATCH,
    ReasonKind.OTHERS_CONTRADICT: ("distance", "turn"),
    ReasonKind.MAPS_CONTRADICT: _MATCH,
    ReasonKind.MAPS_CONTRADICT_JOINTLY: _MATCH,
}
_MAY_NAME_RIVAL = {ReasonKind.UNSURE, ReasonKind.CONVINCING}
_ABOUT_FOUND = {
    ReasonKind.PARTS_AGREE,
    ReasonKind.BENT,
    ReasonKind.MET_BEFORE,
    ReasonKind.FOLLOWED,
    ReasonKind.MIRRORED,
    ReasonKind.OTHERS_CONTRADICT,
    ReasonKind.MAPS_CONTRADICT,
    ReasonKind.MAPS_CONTRADICT_JOINTLY,
    ReasonKind.UNDECIDED,
    ReasonKind.FORBIDDEN,
    ReasonKind.FORBIDDEN_BETWEEN,
}
_MAY_BE_ABOUT_FOUND = {ReasonKind.PINNED}
_OF_WORDS = {
    ReasonKind.WORDS,
    ReasonKind.PINNED,
    ReasonKind.FORBIDDEN,
    ReasonKind.FORBIDDEN_BETWEEN,
}


@dataclass(frozen=True, slots=True)
class Reason:
    """A reason for a decision.

    Attributes
    ----------
    kind
        Which.
    numbers
        Those of its kind, by name: lengths and distances [m], `turn` [rad], `confidence` in [0, 1];
        `common` and `contradicted` are of the best hypothesis, `rival_common` and
        `rival_contradicted` of the best different one, which `distance` and `turn` tell apart.
    found
        What was found before, where this says more about it.
    text
        The sentence, of words alone; of what was ordered, who ordered it and why.

    Raises
    ------
    ValueError
        If the numbers, or what was found, are not those of its kind.
    """

    kind: ReasonKind
    numbers: Mapping[str, float] = field(default_factory=dict)
    found: "Reason | None" = None
    text: str = ""

    def __post_init__(self) -> None:
        needed = set(_NUMBERS.get(self.kind, ()))
        if set(self.numbers) not in (needed, needed | self._optional()):
            wanted = ", ".join(sorted(needed)) or "no numbers"
            raise ValueError(f"reason {self.kind}: expected {wanted}, found {sorted(self.numbers)}")
        about = self.kind in _ABOUT_FOUND
        if (self.found is not None) != about and self.kind not in _MAY_BE_ABOUT_FOUND:
            how = "with" if about else "without"
            raise ValueError(f"reason {self.kind}: expected {how} what was found before")
        if self.text and self.kind not in _OF_WORDS:
            raise ValueError(f"reason {self.kind}: expected no words")
        if self._depth() > MAX_DEPTH:
            raise ValueError(f"reason {self.kind}: expected at most {MAX_DEPTH} in a row")

    @classmethod
    def words(cls, text: str) -> Self:
        """Return the reason of which only a sentence is known."""
        return cls(ReasonKind.WORDS, text=text)

    @classmethod
    def picked(
        cls, kind: ReasonKind, numbers: Mapping[str, float], found: "Reason | None", text: str
    ) -> Self:
        """Return the reason with those of `numbers` that its kind has; others are left out."""
        names = (*_NUMBERS.get(kind, ()), *(_RIVAL if kind in _MAY_NAME_RIVAL else ()))
        return cls(kind, {name: numbers[name] for name in names if name in numbers}, found, text)

    def _optional(self) -> set[str]:
        return set(_RIVAL) if self.kind in _MAY_NAME_RIVAL else set()

    def _depth(self) -> int:
        depth, found = 1, self.found
        while found is not None:
            depth, found = depth + 1, found.found
        return depth


class StatusKind(StrEnum):
    """What became of an alignment in a joint map."""

    RELIED_ON = "relied_on"
    SET_ASIDE = "set_aside"  # accepted by those who compared; others, or the maps, contradict it
    REVOKED = "revoked"  # an earlier version relied on it
    HELD = "held"  # relied on only because the robots met before


@dataclass(frozen=True, slots=True)
class Status:
    """What became of an alignment in a joint map, and by what.

    Attributes
    ----------
    kind
        Which.
    set_aside_by
        The components whose alignments, or whose maps, contradict it, in pairs; empty where
        nothing tells which is wrong, and where nothing was set aside.
    revoked_in
        The version that no longer relied on it; None unless it is revoked.

    Raises
    ------
    ValueError
        If what is given is not of its kind.
    """

    kind: StatusKind
    set_aside_by: tuple[Pair, ...] = ()
    revoked_in: int | None = None

    def __post_init__(self) -> None:
        if (self.revoked_in is not None) != (self.kind is StatusKind.REVOKED):
            raise ValueError(f"status {self.kind}: expected a version if, and only if, it revoked")
        if self.set_aside_by and self.is_relied_on:
            raise ValueError(f"status {self.kind}: expected nothing that sets it aside")

    @property
    def is_relied_on(self) -> bool:
        """Whether the joint map rests on it."""
        return self.kind in (StatusKind.RELIED_ON, StatusKind.HELD)
