"""Whether a scan is where it was found, or fits nowhere.

What was seen speaks for a pose or against it; how far it is from where the robot should be speaks
as well. A robot that was carried off sees look-alikes within reach: these are disputed, or take a
leap to get to.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.geometry.ellipses import ellipse
from mapweave.mapping.tracking.local_map import ScanEvidence

NO_DRIFT: FloatArray = np.zeros((3, 3))
NO_DRIFT.setflags(write=False)


class AcceptanceParameters(BaseModel):
    """What a pose must show; scores, shares and surprises are shares of the returns."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    novelty: float = Field(
        0.5,
        ge=0,
        le=1,
        description="what a return at a new place counts, against an explained one;"
        " at 0 a pose that shows nothing new would always win",
    )
    convincing: float = Field(0.75, description="score above which a pose is taken as it is")
    acceptable: float = Field(0.5, description="score above which it is, if all was searched")
    plausible: float = Field(0.25, description="score above which it is, with more to be said")
    max_doubt: float = Field(
        0.25, gt=0, description="about a pose that does not convince: its disputed share, its leap"
    )
    leap: float = Field(2.5, ge=0, description="what surprise counts in that doubt")
    margin: float = Field(0.2, gt=0, description="of score to the best different pose, the rival")
    rival_distance: float = Field(0.5, gt=0, description="[m] between rivals")
    rival_turn: float = Field(0.2, gt=0, description="[rad] between rivals")
    same_distance: float = Field(
        0.2, gt=0, description="[m] between fits that ended at one place, at the most"
    )
    same_turn: float = Field(0.1, gt=0, description="[rad] likewise")
    remarkable: float = Field(
        0.05, ge=0, description="surprise beyond which a pose is compared with everything else"
    )
    lead: float = Field(
        0.05, ge=0, description="share of the returns by which it must be worth more than another"
    )
    open_direction: float = Field(
        0.1, gt=0, lt=1, description="a direction held less than this share of the other is open"
    )
    held: float = Field(
        2.5, gt=0, description="points that hold a pose in every direction, after a miss"
    )
    max_denied: float = Field(
        0.13,
        ge=0,
        le=1,
        description="share of the returns of which walls deny a pose, after a miss; it is more at"
        " one in a hundred of the right poses, in whatever building, and at half of the wrong ones",
    )
    expected: float = Field(0.02, ge=0, description="surprise up to which a pose is expected")
    expected_dispute: float = Field(0.15, ge=0, description="disputed share of one, at most")
    undisputed: float = Field(0.05, ge=0, description="disputed share of one, after a miss")


@dataclass(frozen=True, slots=True, eq=False)
class ScanMatch:
    """A pose found for a scan.

    Attributes
    ----------
    pose
        (3,) where [m, m, rad], tracking frame.
    evidence
        What speaks for and against it.
    information
        (3, 3) of `Fit`: which directions are held.
    surprise, leap
        How unlikely the step to it is, for this robot and for any; see `MotionModel`.
    drift
        (3, 3) covariance of the robot's pose, by what nothing held before; see `Drift`.
    unsettled
        [m] along the direction that its walls leave open, to the farthest pose worth about as much.
    """

    pose: FloatArray
    evidence: ScanEvidence
    information: FloatArray
    surprise: float = 0.0
    leap: float = 0.0
    drift: FloatArray = field(default_factory=lambda: NO_DRIFT)
    unsettled: float = 0.0

    def value(self, novelty: float) -> float:
        """Evidence less surprise: corridors leave a direction open, and speed is bounded."""
        return self.evidence.score + novelty * self.evidence.novel - self.surprise


FIRST = ScanMatch(se2.IDENTITY, ScanEvidence(1.0, 0.0, 0.0), np.zeros((3, 3)))
"""The first scan defines the frame."""


def is_credible(tracked: ScanMatch, parameters: AcceptanceParameters) -> bool:
    """Whether a pose convinces, or is hardly disputed and takes no leap to get to."""
    p = parameters
    doubt = tracked.evidence.disputed + p.leap * tracked.surprise
    return tracked.evidence.score >= p.convincing or doubt <= p.max_doubt


def tell_apart(
    found: Sequence[ScanMatch],
    novelty: float,
    parameters: AcceptanceParameters,
    denied: Callable[[ScanMatch], float],
) -> list[ScanMatch]:
    """Return the poses that count after a miss, where the best can be told from look-alikes.

    None where a different pose of those `found` is worth more than the best of them: along bare
    walls many are as good, and the one that is held is so by chance. Nor where walls
    deny the best one: a room fits itself, turned by a quarter.

    Parameters
    ----------
    novelty
        What a return at a new place counts.
    denied
        Tells of what share of its returns walls deny that the scan was taken there.
    """
    again = [tracked for tracked in found if _is_found_again(tracked, parameters)]
    best = max(again, key=lambda t: t.value(novelty), default=None)
    if best is None or denied(best) > parameters.max_denied:
        return []
    rivals = _rivals(best, found, parameters)
    outdone = any(t.value(novelty) > best.value(novelty) for t in rivals)
    return [] if outdone else again


def _is_found_again(tracked: ScanMatch, parameters: AcceptanceParameters) -> bool:
    """Whether a pose counts after a miss: held in every direction, and better than look-alikes.

    The robot may be anywhere. So it must explain half of what cannot have come since; or the robot
    should be there and hardly anything speaks against it.
    """
    p, evidence = parameters, tracked.evidence
    undisputed = evidence.disputed <= p.undisputed and tracked.surprise <= p.expected
    explains = evidence.without_excused.score >= p.acceptable
    return _is_held(tracked, p) and (explains or undisputed)


def is_acceptable(
    best: ScanMatch, found: Sequence[ScanMatch], parameters: AcceptanceParameters
) -> bool:
    """Whether the best of all that was `found`, and counts, is taken, though it explains little.

    As at the edge of the known: where the robot should be and undisputed, or without a rival, and
    without a better place nearby.
    """
    p, evidence = parameters, best.evidence
    if _is_proven(best, found, p):
        return True
    if evidence.score < p.plausible:
        return False
    if evidence.disputed <= p.expected_dispute and best.surprise <= p.expected:
        return True
    doubt = evidence.disputed + p.leap * best.leap
    if doubt > p.max_doubt or evidence.score - _best_rival(best, found, p) < p.margin:
        return False
    return not _is_outdone_nearby(best, found, p)


def _is_outdone_nearby(
    best: ScanMatch, found: Sequence[ScanMatch], p: AcceptanceParameters
) -> bool:
    """Whether another place, nearer than a rival, explains more than the best, which is likelier.

    Then it is not known to some centimetres, as its walls would have it.
    """
    others = _different(best, found, p.same_distance, p.same_turn)
    return any(t.evidence.score > best.evidence.score and not _is_slid(best, t, p) for t in others)


def _is_proven(best: ScanMatch, found: Sequence[ScanMatch], p: AcceptanceParameters) -> bool:
    """Whether a pose is held, and explains half of what cannot have come since, as no other does.

    Then it need be free neither of dispute nor of a leap, but of much of either.
    """
    evidence = best.evidence.without_excused
    rivals = [t.evidence.without_excused.score for t in _rivals(best, found, p)]
    doubt = max(evidence.disputed, p.leap * best.leap)
    stands_out = evidence.score - max(rivals, default=-1.0) >= p.margin
    explains = evidence.score >= p.acceptable
    return _is_held(best, p) and explains and doubt <= p.max_doubt and stands_out


def is_ambiguous(
    best: ScanMatch, found: Sequence[ScanMatch], turn: float, parameters: AcceptanceParameters
) -> bool:
    """Whether a remarkable pose, with a `turn` [rad], is not clearly worth most of all `found`.

    Those along a direction that its walls leave open are not different: how far along is not known,
    and its uncertainty says so.
    """
    p = parameters
    if is_turned_blindly(best, turn, p):
        return True
    if best.surprise <= p.remarkable:
        return False
    least = best.value(p.novelty) - p.lead
    return any(t.value(p.novelty) > least and is_rival(best, t, p) for t in found)


def is_unremarkable(best: ScanMatch, turn: float, parameters: AcceptanceParameters) -> bool:
    """Whether a pose, with a `turn` [rad], need not be compared with everything else."""
    p = parameters
    return best.surprise <= p.remarkable and not is_turned_blindly(best, turn, p)


def is_turned_blindly(best: ScanMatch, turn: float, parameters: AcceptanceParameters) -> bool:
    """Whether nothing tells a `turn` [rad] from one by half a turn more or less.

    Along bare walls half a turn changes nothing: more than a quarter is as well less than one the
    other way, however often this robot turns round.
    """
    return abs(turn) > np.pi / 2 and not _is_held(best, parameters)


def best_by_sight(
    found: Sequence[ScanMatch],
    parameters: AcceptanceParameters,
    denied: Callable[[ScanMatch], float],
) -> ScanMatch | None:
    """Return the best of the poses `found` by what was seen and nothing else, if that tells.

    Not where another pose is worth as much: a look-alike; nor where something is left open, or
    walls deny it.

    Parameters
    ----------
    denied
        As `tell_apart` has it.
    """
    p = parameters

    def worth(tracked: ScanMatch) -> float:
        return tracked.evidence.score + p.novelty * tracked.evidence.novel

    best = max(found, key=worth)
    if best.evidence.score < p.acceptable or not _is_held(best, p) or denied(best) > p.max_denied:
        return None
    alike = (t for t in found if worth(t) > worth(best) - p.lead)
    return None if any(is_rival(best, t, p) for t in alike) else best


def is_rival(best: ScanMatch, other: ScanMatch, parameters: AcceptanceParameters) -> bool:
    """Whether `other` is another pose, not just elsewhere along a direction that is open."""
    return bool(_rivals(best, [other], parameters)) and not _is_slid(best, other, parameters)


def unsettled(
    best: ScanMatch, found: Sequence[ScanMatch], novelty: float, parameters: AcceptanceParameters
) -> float:
    """Return how far [m] from the best, along an open direction, another is worth about as much.

    As in a corridor with a door every two metres: the next one fits nearly as well. Where it is as
    expected, the pace has told these apart.

    Parameters
    ----------
    novelty
        What a return at a new place counts there.
    """
    p = parameters
    if best.surprise <= p.remarkable or not is_open(best, p):
        return 0.0
    least = best.value(novelty) - p.lead
    alike = [t for t in _rivals(best, found, p) if t.value(novelty) > least]
    return max((_apart(best, t) for t in alike if _is_slid(best, t, p)), default=0.0)


def is_open(tracked: ScanMatch, p: AcceptanceParameters) -> bool:
    """Whether its walls leave a direction open."""
    held = ellipse(tracked.information)
    return held.least <= p.open_direction * held.most


def _is_slid(best: ScanMatch, other: ScanMatch, p: AcceptanceParameters) -> bool:
    """Whether `other` is `best`, but for how far along an open direction it is."""
    if not is_open(best, p) or abs(se2.wrap(other.pose[2] - best.pose[2])) > p.rival_turn:
        return False
    across = np.linalg.eigh(best.information[:2, :2])[1][:, 1]
    return bool(abs(across @ (other.pose - best.pose)[:2]) <= p.rival_distance)


def _apart(one: ScanMatch, other: ScanMatch) -> float:
    """[m] between two poses."""
    return float(np.hypot(*(one.pose - other.pose)[:2]))


def _is_held(tracked: ScanMatch, p: AcceptanceParameters) -> bool:
    """Whether what was seen holds a pose in every direction."""
    return ellipse(tracked.information).least >= p.held


def _best_rival(best: ScanMatch, found: Sequence[ScanMatch], p: AcceptanceParameters) -> float:
    """The best score of those that differ from `best`; -1 where none does."""
    return max((t.evidence.score for t in _rivals(best, found, p)), default=-1.0)


def _rivals(
    best: ScanMatch, found: Sequence[ScanMatch], p: AcceptanceParameters
) -> list[ScanMatch]:
    """Those that are somewhere else than `best`."""
    return _different(best, found, p.rival_distance, p.rival_turn)


def _different(
    best: ScanMatch, found: Sequence[ScanMatch], distance: float, turn: float
) -> list[ScanMatch]:
    """Those more than `distance` [m] or `turn` [rad] from `best`."""
    apart = se2.between(best.pose, np.stack([tracked.pose for tracked in found]))
    different = (np.hypot(*apart[:, :2].T) > distance) | (np.abs(apart[:, 2]) > turn)
    return [t for t, other in zip(found, different, strict=True) if other]
