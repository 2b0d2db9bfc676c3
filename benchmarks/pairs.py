"""Pairs of stretches: what mapweave decides about each, against the truth."""

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import combinations
from typing import Literal

import numpy as np

from benchmarks.ablation import Aligning
from benchmarks.meetings import meeting_error
from benchmarks.stretches import Stretch, alignment_error, common
from mapweave.fusion.align import FusionParameters, align
from mapweave.maps import Alignment

Outcome = Literal["joined right", "joined wrong", "ambiguous", "refused"]

RIGHT_DISTANCE, RIGHT_TURN = 0.5, math.radians(5.0)  # [m], [rad] at the median


@dataclass(frozen=True, slots=True)
class Match:
    """One alignment of two components, judged.

    Attributes
    ----------
    distance, turn
        How far off it is where the robots met [m], [rad]; infinite and pi across buildings.
    whole
        How far off it is at the median over the map, as one rigid piece [m].
    bends
        [m] rms by which the two maps are bent themselves.
    right
        Whether that is within 0.5 m and 5°.
    """

    alignment: Alignment
    distance: float
    turn: float
    whole: float
    bends: tuple[float, float]
    right: bool


@dataclass(frozen=True, slots=True)
class Pair:
    """Two stretches compared.

    Attributes
    ----------
    first, second
        Their names.
    buildings
        Where each was recorded.
    common
        [m] of wall that both saw, by the corrected poses.
    segments
        Of the two maps.
    matches
        One for each pair of their components.
    seconds
        That comparing took, all components together.
    """

    first: str
    second: str
    buildings: tuple[str, str]
    common: float
    segments: tuple[int, int]
    matches: tuple[Match, ...]
    seconds: float

    @property
    def crosses(self) -> bool:
        """Whether the stretches are of different buildings."""
        return self.buildings[0] != self.buildings[1]

    @property
    def outcome(self) -> Outcome:
        """What was decided; one wrong join outweighs all else."""
        joins = [match for match in self.matches if match.alignment.decision == "accepted"]
        if joins:
            return "joined right" if all(match.right for match in joins) else "joined wrong"
        if any(match.alignment.decision == "ambiguous" for match in self.matches):
            return "ambiguous"
        return "refused"


def choose_pairs(
    stretches: Sequence[Stretch], most_across: int, seed: int
) -> list[tuple[Stretch, Stretch]]:
    """Return every pair within a log, and at most `most_across` pairs across buildings.

    Stretches of two logs of one building make no pair: they may overlap, and their corrected
    poses share no frame.
    """
    pairs = list(combinations(stretches, 2))
    within = [(a, b) for a, b in pairs if a.log == b.log]
    across = [(a, b) for a, b in pairs if a.log.building != b.log.building]
    if len(across) > most_across:
        drawn = np.random.default_rng(seed).choice(len(across), most_across, replace=False)
        across = [across[k] for k in sorted(drawn)]
    return within + across


def compare(
    first: Stretch,
    second: Stretch,
    parameters: FusionParameters | None = None,
    aligning: Aligning = align,
) -> Pair:
    """Align the maps of two stretches as robots do, and judge what comes of it.

    What is known of how rare shapes are is of other buildings.
    """
    known = tuple(sorted({first.log.building, second.log.building}))
    parameters = without_buildings(parameters or FusionParameters(), known)
    start = time.perf_counter()
    alignments = aligning(first.robot_map, second.robot_map, parameters)
    seconds = time.perf_counter() - start
    return Pair(
        first.name,
        second.name,
        (first.log.building, second.log.building),
        common(first, second),
        (first.segments, second.segments),
        tuple(judge(first, second, alignment) for alignment in alignments),
        seconds,
    )


@lru_cache(64)
def without_buildings(parameters: FusionParameters, buildings: tuple[str, ...]) -> FusionParameters:
    """Return `parameters` whose background of shapes never saw `buildings`."""
    asked = parameters.hypotheses
    rarity = asked.rarity.model_copy(update={"left_out": buildings})
    hypotheses = asked.model_copy(update={"rarity": rarity})
    return parameters.model_copy(update={"hypotheses": hypotheses})


def is_right(distance: float, turn: float) -> bool:
    """Tell whether an alignment that is off by `distance` [m] and `turn` [rad] is right."""
    return distance <= RIGHT_DISTANCE and turn <= RIGHT_TURN


def judge(first: Stretch, second: Stretch, alignment: Alignment) -> Match:
    """Say how far off an alignment of two stretches is."""
    reference, other = first.parts[alignment.reference], second.parts[alignment.other]
    distance, turn, whole = math.inf, math.pi, math.inf
    if first.log.building == second.log.building:
        maps = first.robot_map, second.robot_map
        distance, turn = meeting_error(reference, other, maps, alignment)
        whole, _ = alignment_error(reference, other, alignment.transform)
    right = is_right(distance, turn)
    return Match(alignment, distance, turn, whole, (reference.bend, other.bend), right)
