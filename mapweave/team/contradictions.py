"""What maps say of each other where no alignment compares them: doubt in what joins them.

Robots a and c, joined by way of b, may both have seen the same place. Walls of one where the other
saw through speak against one of the alignments between them.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from math import inf
from typing import TypeAlias

import numpy as np
from pydantic import Field

from mapweave.fusion.beyond import judged_around
from mapweave.fusion.extrapolation import ExtrapolationParameters
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray, Int32Array
from mapweave.matching.distance_field import DistanceField
from mapweave.matching.verification import (
    Tally,
    VerificationParameters,
    tally,
)
from mapweave.parameters import StageParameters, derived
from mapweave.team.consistency import bits
from mapweave.team.cycles import Edge, poses_along
from mapweave.team.min_cut import groups
from mapweave.team.recent import Recent


class ContradictionParameters(StageParameters):
    """How much contradiction is to be expected, and what more of it means.

    Of some 90 pairs of stretches of the Intel, Seattle, CSAIL and Freiburg logs at their true
    poses, none had more than 0.3 m beyond this allowance; moved by 2 to 8 m, half of them had more
    than 2 m (CSAIL) to 57 m (Freiburg).
    """

    verification: VerificationParameters = derived(VerificationParameters.of)
    bends: ExtrapolationParameters = ExtrapolationParameters()
    allowance: float = Field(
        0.25,
        ge=0,
        lt=1,
        description="share contradicted of the wall that both looked at, that bent maps may have",
    )
    metres_per_log: float = Field(
        1.5, gt=0, description="[m] contradicted beyond that, that make it e times less probable"
    )
    within: float = Field(
        20.0, gt=0, description="[m] from the places that hold two maps, to which walls are asked"
    )
    step: float = Field(0.1, gt=0, description="[m] poses nearer to each other are judged once")
    turn_step: float = Field(0.01, gt=0, description="[rad] as well")


# By both rasters, the transform in thousandths of the steps, and the places that hold them.
KnownVerdicts: TypeAlias = Recent[tuple[DistanceField, DistanceField, int, int, int, bytes], Tally]
PARTS = 1000  # of a step, to which a transform is rounded when it is judged


@dataclass(frozen=True, slots=True)
class PairVerdict:
    """Two components that contradict each other, and how.

    Attributes
    ----------
    first, second
        Their numbers.
    tally
        What they say of how they are placed.
    doubt
        The log of the odds against that.
    """

    first: int
    second: int
    tally: Tally
    doubt: float


class PairVerdicts:
    """The maps of numbered components; remembers what they said.

    Parameters
    ----------
    rasters
        Of each component that has seen any wall, in its frame.
    frames
        (n, 3) of the graph's nodes in the components' frames.
    known
        What rasters said before, of transforms rounded so finely that it does not matter.
    """

    def __init__(
        self,
        rasters: Mapping[int, DistanceField],
        frames: FloatArray,
        parameters: ContradictionParameters,
        known: KnownVerdicts | None = None,
    ) -> None:
        self._rasters, self._frames, self._p = rasters, frames, parameters
        self._verdicts: KnownVerdicts = Recent() if known is None else known
        self._known: dict[tuple[int | bytes, ...], PairVerdict | None] = {}
        self._reach = {k: _reach(raster, frames[k]) for k, raster in rasters.items()}

    def ask(
        self,
        pairs: Sequence[tuple[int, int]],
        transforms: FloatArray,
        held: Sequence[FloatArray],
    ) -> list[PairVerdict]:
        """Return what speaks against transforms (n, 3), each of a pair's second to its first.

        Parameters
        ----------
        held
            Of each pair (k, 2) the places that hold it [m], frame of the second's node: beyond,
            maps may be bent. None where they are taken to be rigid.
        """
        steps = np.array([self._p.step, self._p.step, self._p.turn_step])
        keys = np.round(transforms / steps).astype(np.int64).tolist()
        rounded = np.round(transforms / (steps / PARTS)).astype(np.int64).tolist()
        apart = np.hypot(transforms[:, 0], transforms[:, 1]).tolist()
        found = []
        for k, (first, second) in enumerate(pairs):
            # What has seen no wall says nothing, nor do two that are too far apart.
            if apart[k] > self._reach.get(first, -inf) + self._reach.get(second, -inf):
                continue
            around = np.round(held[k] / self._p.step).astype(np.int32)
            key = (first, second, *keys[k], around.tobytes())
            if key not in self._known:
                self._known[key] = self._judge(first, second, rounded[k], around)
            verdict = self._known[key]
            if verdict is not None:
                found.append(verdict)
        return found

    def _judge(
        self, first: int, second: int, at: Sequence[int], around: Int32Array
    ) -> PairVerdict | None:
        """Judge the transform that lies `at` so many parts of the steps, held `around` places."""
        p = self._p
        one, other = self._rasters[first], self._rasters[second]
        x, y, turn = at

        def judge() -> Tally:
            rounded = np.array(at) * np.array([p.step, p.step, p.turn_step]) / PARTS
            there = se2.compose(rounded, se2.inverse(self._frames[second]))
            pose = se2.compose(self._frames[first], there)
            found = tally(one, other, pose, p.verification)
            if len(around) == 0 or self._excess(found) <= 0:
                return found
            held = se2.transform_points(self._frames[second], around * p.step)
            about = one, other, pose, held, p.verification, p.bends, p.within
            return Tally(*judged_around(*about))

        told = self._verdicts.get((one, other, x, y, turn, around.tobytes()), judge)
        excess = self._excess(told)
        if excess <= 0:
            return None
        return PairVerdict(first, second, told, excess / p.metres_per_log)

    def _excess(self, told: Tally) -> float:
        """[m] contradicted beyond what is to be expected."""
        both = max(told.common, 0.0) + told.contradicted
        return told.contradicted - self._p.allowance * both


class MapContradictions:
    """What the maps say against a choice of edges."""

    def __init__(self, count: int, edges: Sequence[Edge], witnesses: PairVerdicts) -> None:
        self._count, self._edges, self._witnesses = count, edges, witnesses

    def __call__(self, removed: int) -> tuple[float, int]:
        """Return the doubt in the edges that are left, and those between the worst witnesses."""
        present = [k for k in range(len(self._edges)) if not removed >> k & 1]
        against = self.against(present)
        if not against:
            return 0.0, 0
        worst = max(against, key=lambda witness: witness.doubt)
        _, paths = poses_along(worst.first, self._count, self._edges, present)
        return sum(witness.doubt for witness in against), paths[worst.second]

    def against(self, present: Sequence[int]) -> list[PairVerdict]:
        """Return all that speaks against the edges `present`."""
        found: list[PairVerdict] = []
        for group in groups(self._count, self._edges, present):
            if len(group) == 1:
                continue
            poses, paths = poses_along(group[0], self._count, self._edges, present)
            pairs = list(combinations(group, 2))
            first, second = np.array(pairs).T
            places = {k: self._places(k, poses) for k in present if self._edges[k].first in group}
            back = {j: se2.inverse(poses[j]) for j in group}
            held = [
                se2.transform_points(back[j], self._held(paths[i] ^ paths[j], places))
                for i, j in pairs
            ]
            found += self._witnesses.ask(pairs, se2.between(poses[first], poses[second]), held)
        return found

    def _places(self, k: int, poses: FloatArray) -> FloatArray:
        """(n, 2) places that hold edge `k`, in the frame of the (m, 3) poses."""
        edge = self._edges[k]
        return se2.transform_points(poses[edge.first], edge.places)

    def _held(self, way: int, places: Mapping[int, FloatArray]) -> FloatArray:
        """(k, 2) places that hold a way of edges, a bit mask; none where an edge tells of none."""
        found = [places[k] for k in bits(way)]
        return np.concatenate(found) if all(map(len, found)) else np.empty((0, 2))


def _reach(raster: DistanceField, frame: FloatArray) -> float:
    """[m] from a node to the farthest wall of its map."""
    apart = raster.oriented.points - frame[:2]
    return float(np.hypot(apart[:, 0], apart[:, 1]).max())
