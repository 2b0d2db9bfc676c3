"""What operators have ordered, as a joint map tells it: who, when, why, and about what.

An order outranks evidence. It is in force until its operator, or another one, takes it back.
"""

from dataclasses import dataclass
from enum import StrEnum

from mapweave.geometry.arrays import FloatArray

MAX_REASON = 200  # characters: it is told with what it was ordered about, in one sentence


class OrderKind(StrEnum):
    """What is ordered."""

    MARK = "mark"  # something is there
    PIN = "pin"  # two components lie like this
    FORBID = "forbid"  # they are not to be joined, or not like this
    FORGET = "forget"  # runs of a robot are to leave the joint map


class OrderEffect(StrEnum):
    """What an order does in a version."""

    IN_FORCE = "in_force"
    WAITS = "waits"  # what it is about is not there
    OUTRANKED = "outranked"  # later orders contradict it


@dataclass(frozen=True, slots=True, eq=False)
class Order:
    """A pin, a ban or a run to forget; marks are told with what they are on.

    Attributes
    ----------
    id
        Tells it from all others: by it an order is taken back.
    kind
        What is ordered.
    by
        The operator's name.
    time
        When [s since 1970].
    reason
        Why, in the operator's words.
    reference, other
        The two components of a pin or a ban, such as ``a/0``; empty otherwise.
    transform
        (3,) takes coordinates in `other` to coordinates in `reference` [m, m, rad]; None where any
        is meant, and for runs.
    robot, boots
        Whose runs, and which, are to be forgotten; empty otherwise.
    effect
        What it does.
    """

    id: str
    kind: OrderKind
    by: str
    time: float
    reason: str
    reference: str = ""
    other: str = ""
    transform: FloatArray | None = None
    robot: str = ""
    boots: tuple[str, ...] = ()
    effect: OrderEffect = OrderEffect.IN_FORCE

    @property
    def words(self) -> str:
        """Who ordered it, and why, for a person."""
        return f"{self.by}: {self.reason}"
