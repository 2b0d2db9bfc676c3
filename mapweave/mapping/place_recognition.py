"""Recognition: a robot comes to where another of its components is, though both may be bent.

As wholes, two long components may share no one transform. What was tracked over the last tens of
metres is rigid; where it is found in another component twice in a row, at the same place, the robot
is there.
"""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from pydantic import Field

from mapweave.fusion.agreement import AgreementParameters, difference
from mapweave.fusion.align import FusionParameters, compare, prepare
from mapweave.geometry.arrays import FloatArray
from mapweave.maps import Submap, lines_of
from mapweave.matching.distance_field import DistanceField
from mapweave.matching.hypotheses import PreparedMap
from mapweave.matching.verification import verify
from mapweave.parameters import StageParameters


class PlaceRecognitionParameters(StageParameters):
    """What is looked for, and when it is found."""

    submaps: int = Field(3, ge=1, description="that are rigid together, some 36 m of path")
    asked: int = Field(4, ge=1, description="components looked in, the ones of most submaps")
    agreement: AgreementParameters = AgreementParameters()


@dataclass(frozen=True, slots=True, eq=False)
class RecognizedPlace:
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


class PlaceRecognizer:
    """Tells where the newest part is, once the part before was found there as well.

    Where it is found in two components nothing is said: one of them may be a look-alike.
    """

    def __init__(self, parameters: PlaceRecognitionParameters, fusion: FusionParameters) -> None:
        self._p, self._fusion = parameters, fusion
        self._before: dict[tuple[int, int], RecognizedPlace] = {}

    def forget(self) -> None:
        """Begin anew, as when components were joined: frames have changed."""
        self._before = {}

    def look(
        self,
        submaps: Sequence[Submap],
        tracked: Sequence[Submap],
        shape_of: Callable[[int], PreparedMap | None],
    ) -> RecognizedPlace | None:
        """Look for the newest part of `submaps` in the other components.

        Short ones are left out: these are rigid, and compared as wholes.

        Parameters
        ----------
        tracked
            The last submaps that were tracked from one another.
        shape_of
            Prepares a component, by its number.
        """
        before, self._before = self._before, {}
        part = tracked[-self._p.submaps :]
        here = submaps[-1].component if submaps else 0
        others = sorted({s.component for s in submaps} - {here})
        sizes = Counter(s.component for s in submaps)
        long = [c for c in others if sizes[c] > self._p.submaps]
        long = sorted(sorted(long, key=lambda c: -sizes[c])[: self._p.asked])
        if len(part) < self._p.submaps or not long or sizes[here] <= self._p.submaps:
            return None
        newest = prepare(lines_of(part), self._fusion)
        for component in long:
            transform = self._found(part, newest, shape_of(component))
            if transform is not None:
                self._before[here, component] = RecognizedPlace(component, transform)
        again = [
            found
            for pair, found in self._before.items()
            if newest and pair in before and self._agree(before[pair], found, newest)
        ]
        return again[0] if len(again) == 1 else None

    def _found(
        self, part: Sequence[Submap], newest: PreparedMap | None, other: PreparedMap | None
    ) -> FloatArray | None:
        """(3,) transform by which `part` is found in `other`, its last submap as well."""
        alignment = compare("other", other, "newest", newest, self._fusion)
        if alignment.decision != "accepted" or other is None:
            return None
        last = DistanceField.of(lines_of(part[-1:]), self._fusion.raster)
        verdict = verify(other.raster, last, alignment.transform, self._fusion.verification)
        return alignment.transform if verdict.common >= self._fusion.decision.min_common else None

    def _agree(self, before: RecognizedPlace, found: RecognizedPlace, newest: PreparedMap) -> bool:
        """Whether the part before was found at the same place."""
        middle = newest.raster.middle
        apart, turned = difference(before.transform, found.transform, middle)
        return apart <= self._p.agreement.distance and turned <= self._p.agreement.turn
