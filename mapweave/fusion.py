"""Map fusion: the transform between two maps, or a reason why there is none (paper, VIII).

Hypothesise by shape (H1, H2), align (V1), verify by what both maps saw (V2), decide. The best
hypothesis must explain much wall, contradict little free space, be held in every direction, share
a shape, and leave the best *different* hypothesis far behind. Each condition that fails is the
reason given. Where whole maps cannot be joined their parts are compared: maps may be bent.
"""

import itertools
from dataclasses import asdict, dataclass
from functools import cached_property

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from mapweave import se2
from mapweave.arrays import FloatArray
from mapweave.assembly import assemble
from mapweave.confidence import ConfidenceParameters, confidence
from mapweave.hypotheses import HypothesisParameters, Shape, different, hypothesise
from mapweave.icp import IcpParameters, Target, align_all
from mapweave.map_raster import RasterParameters
from mapweave.maps import Alignment, Decision, LineMap, RobotMap, component_name
from mapweave.parts import PartParameters, agreed, cut
from mapweave.verification import Verdict, VerificationParameters, shared_complexity, verify


class FusionParameters(BaseModel):
    """One model for each stage, and what an alignment must show to be accepted.

    The limits were set on stretches of the Intel, CSAIL and Seattle logs.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    raster: RasterParameters = RasterParameters()
    hypotheses: HypothesisParameters = HypothesisParameters()
    # Right transforms contradict next to nothing, wrong ones a metre in ten: at a weight of 5 the
    # right one scored highest for every pair of stretches with 10 m and more in common.
    verification: VerificationParameters = VerificationParameters(contradiction_weight=5.0)
    icp: IcpParameters = IcpParameters(start_scale=0.25, end_scale=0.1, shrink=0.6)
    icp_samples: int = Field(250, ge=10, description="of a map's walls, aligning hypotheses")
    loose: float = Field(0.5, gt=0, description="[m] a hypothesis may be off, before alignment")
    confidence: ConfidenceParameters = ConfidenceParameters()
    parts: PartParameters = PartParameters()
    min_wall: float = Field(4.0, gt=0, description="[m] of wall that a map has, to be compared")
    min_common: float = Field(6.0, gt=0, description="[m] of wall in common")
    min_overlap: float = Field(
        0.95,
        gt=0,
        le=1,
        description="of the wall that both looked at, the share in common: at least 0.976 for right"
        " transforms of stretches of the Intel, CSAIL and Seattle logs; 0.91 for a wrong one in the"
        " look-alike corridors of Killian Court",
    )
    min_held: float = Field(
        2.5, gt=0, description="[m] of common wall across the weakest direction"
    )
    min_complexity: float = Field(
        0.05, ge=0, description="[rad²] sc(P) of a shared polyline (V2): not just straight walls"
    )
    min_confidence: float = Field(0.85, gt=0, lt=1, description="of an accepted alignment")
    max_rival: float = Field(
        0.5, gt=0, lt=1, description="score of the best different hypothesis, as a share"
    )
    min_lead: float = Field(
        8.0,
        ge=0,
        description="[m] of score before the best different hypothesis: 8.4 m at least for right"
        " transforms of stretches of the same logs and of Freiburg 079, but for one of 7.8 m;"
        " 6.2 m for a wrong one between two buildings",
    )


@dataclass(frozen=True, slots=True, eq=False)
class Hypothesis:
    """An aligned hypothesis with its verdict.

    Attributes
    ----------
    transform
        (3,) from the other map to the reference [m, m, rad].
    place
        (2,) where it takes the middle of the other map's wall [m]: what tells hypotheses apart,
        because it depends on no frame.
    verdict
        What both maps say of it.
    complexity
        [rad²] of what is shared (V2).
    """

    transform: FloatArray
    place: FloatArray
    verdict: Verdict
    complexity: float


def align_robots(
    reference: RobotMap, other: RobotMap, parameters: FusionParameters | None = None
) -> list[Alignment]:
    """Compare every component of `reference` with every one of `other`."""
    p = parameters or FusionParameters()
    ours, theirs = ([_Component(m, c, p) for c in m.components] for m in (reference, other))
    return [_align(a, b, p) for a, b in itertools.product(ours, theirs)]


class _Component:
    """A component of a robot's map, prepared as a whole and, where it is asked for, in parts."""

    def __init__(self, robot_map: RobotMap, number: int, p: FusionParameters) -> None:
        self._robot_map, self._number, self._p = robot_map, number, p
        self.name = component_name(robot_map.robot, number)
        self.whole = prepare(assemble(robot_map, number), p)

    @cached_property
    def parts(self) -> list[Shape]:
        """Those with enough wall to compare."""
        cuts = cut(self._robot_map, self._number, self._p.parts)
        shapes = [prepare(lines, self._p) for lines in cuts] if len(cuts) > 1 else [self.whole]
        return [shape for shape in shapes if shape is not None]


def _align(first: _Component, second: _Component, p: FusionParameters) -> Alignment:
    """Compare two components; in parts, where as wholes they cannot be joined: they may be bent."""
    whole = compare(first.name, first.whole, second.name, second.whole, p)
    if whole.decision == "accepted":
        return whole
    pairs = list(itertools.product(first.parts, second.parts))
    if len(pairs) < 2:
        return whole
    found = [(compare(first.name, a, second.name, b, p), b) for a, b in pairs]
    joined = [
        (x, b.raster.surface.points.mean(axis=0)) for x, b in found if x.decision == "accepted"
    ]
    return agreed([x for x, _ in joined], np.array([m for _, m in joined]), p.parts) or whole


def align_maps(
    reference: tuple[str, LineMap],
    other: tuple[str, LineMap],
    parameters: FusionParameters | None = None,
) -> Alignment:
    """Find the transform from `other` to `reference`, each a component's name and its lines."""
    p = parameters or FusionParameters()
    (a, first), (b, second) = reference, other
    return compare(a, prepare(first, p), b, prepare(second, p), p)


def prepare(lines: LineMap, p: FusionParameters) -> Shape | None:
    """Return what comparing `lines` takes; None where there is too little wall to compare."""
    wall = np.hypot(*(lines.segments[:, 2:] - lines.segments[:, :2]).T).sum()
    return Shape.of(lines, p.hypotheses, p.raster) if wall >= p.min_wall else None


def compare(
    a: str,
    first: Shape | None,
    b: str,
    second: Shape | None,
    p: FusionParameters,
    possible: FloatArray | None = None,
) -> Alignment:
    """Find the transform from `second`, called `b`, to `first`, called `a`, both prepared.

    Parameters
    ----------
    possible
        (n, 3) transforms of which one is near the right one, if that is known; without it, shapes
        propose.
    """
    if first is None or second is None:
        poor = a if first is None else b
        return _no_alignment(a, b, f"{poor} has less than {p.min_wall:g} m of wall to compare")
    ranked = find_alignments(first, second, p, possible)
    if not ranked:
        return _no_alignment(a, b, "no part of one has the shape of a part of the other")
    best, rival = ranked[0], ranked[1] if len(ranked) > 1 else None
    sure = confidence(best.verdict, rival.verdict if rival else None, p.confidence)
    decision, reason = decide(best, rival, sure, p)
    return Alignment(
        a,
        b,
        best.transform,
        decision,
        sure,
        reason,
        _numbers(best),
        None if rival is None else _runner_up(best, rival),
    )


def find_alignments(
    first: Shape, second: Shape, p: FusionParameters, possible: FloatArray | None = None
) -> list[Hypothesis]:
    """Return the hypotheses that differ, best first; none where no shape proposes any."""
    transforms, _ = hypothesise(first, second, p.hypotheses, p.verification, possible)
    if len(transforms) == 0:
        return []
    aligned = _refined(first, second, transforms, p)
    verdicts = [verify(first.raster, second.raster, t, p.verification) for t in aligned]
    middle = second.raster.surface.points.mean(axis=0)
    # Two that ended in the same place are one, and not each other's rival.
    ranked = different(aligned, np.array([v.score for v in verdicts]), middle, p.hypotheses)
    return [
        Hypothesis(
            aligned[k],
            se2.transform_points(aligned[k], middle),
            verdicts[k],
            _complexity(first, second, aligned[k], p),
        )
        for k in ranked[:2]
    ]


def decide(
    best: Hypothesis, rival: Hypothesis | None, sure: float, p: FusionParameters
) -> tuple[Decision, str]:
    """Return the decision and one sentence that gives the reason; `sure` is the confidence."""
    v = best.verdict
    found = _tell(v)
    if v.common < p.min_common:
        return "refused", f"only {v.common:.1f} m of wall in common"
    if v.overlap < p.min_overlap:
        return (
            "refused",
            f"{v.common:.0f} m of wall in common, but {v.contradicted:.0f} m of wall"
            " where the other saw free space",
        )
    if v.held < p.min_held:
        return "ambiguous", f"{found}; nearly all of it parallel, so one may slide along the other"
    if best.complexity < p.min_complexity:
        return "ambiguous", f"{found}; but only straight walls, no shape that tells places apart"
    if rival is not None and rival.verdict.score > p.max_rival * v.score:
        as_well = f"fits as well, with {_tell(rival.verdict)}"
        return "ambiguous", f"{found}; but {_elsewhere(best, rival)} {as_well}"
    next_best = _next_best(best, rival)
    lead = v.score - (max(rival.verdict.score, 0.0) if rival else 0.0)
    if sure < p.min_confidence or lead < p.min_lead:
        return "ambiguous", f"{found}; {next_best}; too little to be sure ({sure:.0%})"
    return "accepted", f"{found}; {next_best}"


def _tell(verdict: Verdict) -> str:
    return f"{verdict.common:.0f} m of wall in common, {verdict.contradicted:.1f} m contradicted"


def _next_best(best: Hypothesis, rival: Hypothesis | None) -> str:
    """The rival and what speaks for and against it, in words."""
    if rival is None or rival.verdict.common < 1:
        return "nothing else fits"
    return f"next best, {_elsewhere(best, rival)}, has {_tell(rival.verdict)}"


def _elsewhere(best: Hypothesis, rival: Hypothesis) -> str:
    """How the rival differs, in words."""
    distance, turn = _difference(best, rival)
    away, degrees = f"{distance:.0f} m away", np.degrees(turn)
    return away if degrees < 9 else f"{away} and turned by {degrees:.0f}°"


def _difference(best: Hypothesis, rival: Hypothesis) -> tuple[float, float]:
    """How far apart two hypotheses put the other map [m], and how differently turned [rad]."""
    x, y = rival.place - best.place
    turn = se2.wrap(rival.transform[2] - best.transform[2])
    return float(np.hypot(x, y)), float(abs(turn))


def _refined(first: Shape, second: Shape, starts: FloatArray, p: FusionParameters) -> FloatArray:
    """Align the walls of `second` to those of `first` (V1) from each of (k, 3) `starts`."""
    surface = second.raster.surface
    stride = 1 + (len(surface) - 1) // p.icp_samples
    target = Target.of(first.raster.surface, p.icp)
    # Held so loosely that any wall is stronger: only what no wall holds stays where it is.
    prior = np.diag([1 / p.loose**2, 1 / p.loose**2, 0.0])
    fits = align_all(surface.at(slice(None, None, stride)), target, starts, p.icp, prior)
    return np.array([fit.pose for fit in fits])


def _complexity(first: Shape, second: Shape, transform: FloatArray, p: FusionParameters) -> float:
    """Return the complexity of what is shared [rad²], in the map that shows more of it (V2)."""
    back = se2.inverse(transform)
    return max(
        shared_complexity(first.raster, second.raster, transform, second.lines, p.verification),
        shared_complexity(second.raster, first.raster, back, first.lines, p.verification),
    )


def _numbers(hypothesis: Hypothesis) -> dict[str, float]:
    """The evidence by name, with the score."""
    verdict = hypothesis.verdict
    numbers = {k: float(v) for k, v in asdict(verdict).items() if k != "contradiction_weight"}
    return {**numbers, "complexity": hypothesis.complexity, "score": verdict.score}


def _runner_up(best: Hypothesis, rival: Hypothesis) -> dict[str, object]:
    distance, turn = _difference(best, rival)
    return {
        "transform": [float(v) for v in rival.transform],
        "distance": distance,
        "turn": turn,
        **_numbers(rival),
    }


def _no_alignment(a: str, b: str, reason: str) -> Alignment:
    return Alignment(a, b, np.zeros(3), "refused", 0.0, reason)
