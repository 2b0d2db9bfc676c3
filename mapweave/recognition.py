"""Recognition: a robot comes to where another of its components is, though both may be bent.

As wholes, two long components may share no one transform. What was mapped over the last tens of
metres is rigid; where it is found in another component twice in a row, at the same place, the robot
is there.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from pydantic import BaseModel, ConfigDict, Field

from mapweave.arrays import FloatArray
from mapweave.assembly import place, unite_lines
from mapweave.fusion import FusionParameters, compare, prepare
from mapweave.hypotheses import Shape
from mapweave.maps import Submap
from mapweave.parts import PartParameters, difference


class RecognitionParameters(BaseModel):
    """What is looked for, and when it is found."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    submaps: int = Field(3, ge=1, description="that are rigid together, some 36 m of path")
    agreement: PartParameters = PartParameters()


@dataclass(frozen=True, slots=True, eq=False)
class Recognised:
    """Where the newest part of a component is in another one.

    Attributes
    ----------
    component
        Number of the other one.
    transform
        (3,) from the component of the newest submap to it [m, m, rad].
    """

    component: int
    transform: FloatArray


class Recognition:
    """Remembers where the part before was found."""

    def __init__(self, parameters: RecognitionParameters, fusion: FusionParameters) -> None:
        self._p, self._fusion = parameters, fusion
        self._before: dict[int, Recognised] = {}

    def look(
        self, submaps: Sequence[Submap], shape_of: Callable[[int], Shape | None]
    ) -> Recognised | None:
        """Look for the newest part of `submaps` in the other components.

        Short ones are left out: these are rigid, and compared as wholes.

        Parameters
        ----------
        shape_of
            Prepares a component, by its number.
        """
        here = submaps[-1].component
        part = [s for s in submaps[-self._p.submaps :] if s.component == here]
        others = [
            c for c in sorted({s.component for s in submaps} - {here}) if self._is_long(submaps, c)
        ]
        if len(part) < self._p.submaps or not self._is_long(submaps, here) or not others:
            self._before = {}
            return None
        newest = prepare(unite_lines([place(s.map, s.pose) for s in part]), self._fusion)
        found = {}
        for component in others:
            alignment = compare("other", shape_of(component), "newest", newest, self._fusion)
            if alignment.decision == "accepted":
                found[component] = Recognised(component, alignment.transform)
        again = [one for one in found.values() if newest and self._confirms(one, newest)]
        self._before = found
        return again[0] if len(again) == 1 else None

    def _is_long(self, submaps: Sequence[Submap], component: int) -> bool:
        return sum(s.component == component for s in submaps) > self._p.submaps

    def _confirms(self, found: Recognised, newest: Shape) -> bool:
        """Whether the part before was found at the same place."""
        before, p = self._before.get(found.component), self._p.agreement
        if before is None:
            return False
        middle = newest.raster.surface.points.mean(axis=0)
        apart, turned = difference(before.transform, found.transform, middle)
        return apart <= p.distance and turned <= p.turn
