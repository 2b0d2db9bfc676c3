"""The numbers behind an alignment, and the best different hypothesis."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Self

from mapweave.geometry.arrays import FloatArray


@dataclass(frozen=True, slots=True)
class Evidence:
    """What was measured of an alignment; None where it was not.

    Attributes
    ----------
    common
        [m] of wall in both maps.
    contradicted
        [m] of wall, of both maps, that the other saw through.
    overlap
        Share of the wall where both looked that coincides.
    residual
        [m] median distance of coinciding walls; infinite where there are none.
    held
        [m] of common wall that hold the least held direction.
    complexity
        [rad²] of the most complex polyline shared (paper, VIII, V2).
    rarity
        [bits] how unlikely it is that two places have the wall ends in common that both maps have.
    score
        [m] in common less, by their weight, those contradicted.
    parts
        How many pairs of parts agree, where the maps were compared in parts.
    spread
        [m] by which those differ.
    reach
        [m] by which the maps go on beyond the wall that they share.
    place
        How probably it is right where both looked, in (0, 1), where that was proven.
    """

    common: float | None = None
    contradicted: float | None = None
    overlap: float | None = None
    residual: float | None = None
    held: float | None = None
    complexity: float | None = None
    rarity: float | None = None
    score: float | None = None
    parts: float | None = None
    spread: float | None = None
    reach: float | None = None
    place: float | None = None

    @classmethod
    def of(cls, numbers: Mapping[str, float]) -> Self:
        """Return what is known of `numbers`, by name; others are left out."""
        return cls(**{f.name: numbers[f.name] for f in fields(cls) if f.name in numbers})

    def by_name(self) -> dict[str, float]:
        """Return what was measured, by name."""
        numbers = ((f.name, getattr(self, f.name)) for f in fields(self))
        return {name: number for name, number in numbers if number is not None}

    @property
    def is_empty(self) -> bool:
        """Whether nothing was measured: there was nothing to compare."""
        return not self.by_name()


@dataclass(frozen=True, slots=True, eq=False)
class RunnerUp:
    """The best *different* hypothesis.

    Attributes
    ----------
    transform
        (3,) takes coordinates in the other component to coordinates in the reference [m, m, rad].
    distance
        [m] between where the two put the middle of the other map.
    turn
        [rad] between them.
    evidence
        Of this hypothesis.
    """

    transform: FloatArray
    distance: float | None = None
    turn: float | None = None
    evidence: Evidence = Evidence()

    @classmethod
    def of(cls, transform: FloatArray, numbers: Mapping[str, float]) -> Self:
        """Return the hypothesis with what is known of `numbers`, by name."""
        return cls(transform, numbers.get("distance"), numbers.get("turn"), Evidence.of(numbers))

    def by_name(self) -> dict[str, float]:
        """Return its numbers, by name; its transform apart."""
        apart = (("distance", self.distance), ("turn", self.turn))
        known = {name: number for name, number in apart if number is not None}
        return {**known, **self.evidence.by_name()}
