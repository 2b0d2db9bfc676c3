"""What a version of the joint map is made of, fixed while it is being built, and how soon."""

from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum

from mapweave.maps import Alignment, JointMap, RobotMap
from mapweave.orders import Order
from mapweave.team.joint_builder import JointMapBuilder
from mapweave.team.revocation import mark_revoked


class Urgency(IntEnum):
    """How soon the next version is due."""

    NONE = 0
    MORE = 1  # submaps wait to be compared, and nobody for that
    SOON = 2
    NOW = 3


@dataclass(frozen=True, slots=True, eq=False)
class Draft:
    """All that goes into a version; building it takes seconds and changes nothing here.

    Attributes
    ----------
    version
        Its number.
    maps, alignments
        All that are known.
    before
        The alignments of the last version, as it judged them.
    orders
        Of operators, marks apart: those are on the maps.
    """

    version: int
    maps: tuple[RobotMap, ...]
    alignments: tuple[Alignment, ...]
    before: tuple[Alignment, ...] = ()
    orders: tuple[Order, ...] = ()

    def build(
        self,
        builder: JointMapBuilder,
        *,
        patient: bool = False,
        is_awaited: bool = True,
        is_overtaken: Callable[[], bool] = lambda: False,
    ) -> JointMap:
        """Return the joint map; what it revokes of the last version, it names.

        Parameters
        ----------
        builder
            Keeps what it made for the versions before.
        patient
            Whether nothing may wait for the next version.
        is_awaited
            Whether somebody waits for this one; if not, it only goes on comparing.
        is_overtaken
            Asked now and then: whether to give it up for one that has more in it.

        Raises
        ------
        OvertakenError
            If it was given up.
        """
        known = self.maps, self.alignments, self.version, self.orders
        joint = builder.build(
            *known, patient=patient, is_awaited=is_awaited, is_overtaken=is_overtaken
        )
        return mark_revoked(joint, self.before)
