"""Rivals: what the next best hypothesis counts beside the best.

Rooms are built alike. A rival that lays one room on another, and nothing else, is no wonder where
the best explains much more than a room: then the room is what exists twice.
"""

from dataclasses import replace

from mapweave.fusion.decision import Hypothesis
from mapweave.fusion.rooms import RoomParameters, Rooms, outside
from mapweave.matching.crossings import CrossingParameters, crossed
from mapweave.matching.distance_field import DistanceField
from mapweave.matching.verification import VerificationParameters


def without_its_room(
    best: Hypothesis,
    rival: Hypothesis | None,
    beyond: float,
    fields: tuple[DistanceField, DistanceField],
    rooms: tuple[Rooms, Rooms],
    verification: VerificationParameters,
    p: RoomParameters,
    crossings: CrossingParameters,
) -> Hypothesis | None:
    """Return `rival` as it counts: a twin of one room by what it has outside of that alone.

    It counts in full unless the best, one room left out, has a good part of what it has, next to
    nothing contradicts the best, and no door of one map is a wall of the other.

    Parameters
    ----------
    beyond
        [m] of wall that `best` has in common, one room left out.
    fields, rooms
        Of the reference, and of the other map.
    """
    if rival is None or best.verdict.overlap < p.clean:
        return rival
    if min(beyond, best.verdict.score) < p.of_rival * rival.verdict.score:
        return rival
    little = outside(*fields, rival.transform, verification, p, rooms)
    if little >= p.min_outside:
        return rival
    if crossed(*fields, best.transform, verification, crossings) >= crossings.door:
        return rival
    return replace(rival, verdict=replace(rival.verdict, common=little))
