"""Who of a team is here, told when it has lasted: that our own link was away is no news of others.

No network and no clock in here.
"""

from collections.abc import Iterator

from mapweave_protocol.link.inbox import Presence
from mapweave_protocol.narration.story import Story
from mapweave_protocol.narration.story_coordinator import CoordinatorStory

GRACE = 2.0  # [s] in which who is gone may be back; after an outage of our link all are
ALONE = 5.0  # [s] after which it is told that nobody is here


class Attendance:
    """Takes in who comes and goes.

    Parameters
    ----------
    team
        The team's id; None where it is not to be told that nobody is here.
    story
        Told of the robots.
    """

    def __init__(self, team: str | None, story: Story) -> None:
        self._team = team
        self._story = story
        self._coordinator = CoordinatorStory()
        # Of a robot, or of a coordinator where that is None, which run may be gone, and since when.
        self._leaving: dict[tuple[str | None, str], float] = {}
        self._began: float | None = None
        self._unlinked: float | None = None
        self._is_outage_told = False
        self._met = team is None

    def robot(self, presence: Presence, now: float) -> Iterator[str]:
        """Take in that a run of a robot is here, or may be gone."""
        yield from self._take(presence.robot, presence.boot, now, here=presence.here)

    def coordinator(self, boot: str, now: float, *, here: bool) -> Iterator[str]:
        """Take in that a coordinator is here, or may be gone."""
        yield from self._take(None, boot, now, here=here)

    def coordinator_spoke(self, now: float) -> Iterator[str]:
        """Take in that a coordinator said how it is."""
        yield from self._coordinator.spoke(now)

    def heard(self) -> None:
        """Note that there is somebody, even if gone by now."""
        self._met = True

    def look(self, now: float, *, linked: bool) -> Iterator[str]:
        """Tell what has lasted until `now` [s].

        Parameters
        ----------
        linked
            Whether a router is connected; unless one is, nothing is known of others.
        """
        self._began = now if self._began is None else self._began
        yield from self._tell_link(now, linked=linked)
        if not linked:
            self._leaving = dict.fromkeys(self._leaving, now)
            self._coordinator.excuse(now)
            return
        for (robot, boot), since in list(self._leaving.items()):
            if now - since >= GRACE:
                yield from self._leave(robot, boot)
        yield from self._coordinator.look(now)
        if not self._met and now - self._began >= ALONE:
            self._met = True
            yield f"nobody of team {self._team} is here yet: no robot, no coordinator"

    def _take(self, robot: str | None, boot: str, now: float, *, here: bool) -> Iterator[str]:
        self._met = True
        if not here:
            if robot is None or self._is_told(robot, boot):
                self._leaving.setdefault((robot, boot), now)
            return
        self._leaving.pop((robot, boot), None)
        # Another run came in its place: it is gone, not here twice.
        for other in [boot for name, boot in self._leaving if name == robot]:
            yield from self._leave(robot, other)
        if robot is None:
            yield from self._coordinator.came(boot, now)
        else:
            yield from self._story.appeared(robot, boot)

    def _leave(self, robot: str | None, boot: str) -> Iterator[str]:
        del self._leaving[robot, boot]
        if robot is None:
            yield from self._coordinator.left(boot)
        elif self._is_told(robot, boot):
            yield from self._story.left(robot, boot)

    def _is_told(self, robot: str, boot: str) -> bool:
        """Whether a run of a robot is here as far as it was told; of others it is no news."""
        state = self._story.robots.get(robot)
        return state is not None and boot in state.claimants.boots

    def _tell_link(self, now: float, *, linked: bool) -> Iterator[str]:
        if linked:
            if self._is_outage_told:
                yield "the router is reached again"
            self._unlinked, self._is_outage_told = None, False
            return
        self._unlinked = now if self._unlinked is None else self._unlinked
        if not self._is_outage_told and now - self._unlinked >= GRACE:
            self._is_outage_told = True
            yield "no router is reached any more: there is no news until one is"
