"""Follows a team that runs until it is done, and says who is lost on the way."""

import time
from collections.abc import Sequence

import zenoh

from mapweave.errors import MapweaveError
from mapweave_deploy.run.display import Display
from mapweave_deploy.run.processes import ProcessGroup
from mapweave_deploy.run.recorder import Recorder, is_done, to_come
from mapweave_protocol.link.asking import ask_for_what_is_valid
from mapweave_protocol.link.inbox import Inbox
from mapweave_protocol.wire.messages import JointStatusMessage
from mapweave_protocol.wire.queries import JointQuery

POLL = 0.2  # [s] after which a dead process or the end is noticed
CAPACITY = 100_000  # messages waiting to be counted


class TeamTimeoutError(MapweaveError):
    """A team that was not done in time."""

    def __init__(self, seconds: float, waiting_for: list[str]) -> None:
        super().__init__(
            f"the team was not done within {seconds:g} s, still to come: {', '.join(waiting_for)}"
        )
        self.seconds = seconds
        self.waiting_for = waiting_for


class Follower:
    """Follows a team.

    Parameters
    ----------
    crew
        Its processes; that of a robot is named by `agent_of`.
    robots
        The robots' ids.
    display
        Shows what happens.
    timeout
        When to give up [s], from now on; None never does.
    """

    def __init__(
        self, crew: ProcessGroup, robots: Sequence[str], display: Display, timeout: float | None
    ) -> None:
        self.recorder = Recorder()
        self.inbox = Inbox(CAPACITY)
        self.lost: list[str] = []
        self._crew = crew
        self._robots = robots
        self._display = display
        self._timeout = timeout
        self._end = None if timeout is None else time.monotonic() + timeout

    @property
    def there(self) -> list[str]:
        """The robots that are not lost."""
        return [robot for robot in self._robots if robot not in self.lost]

    def follow(self, session: zenoh.Session, team: str) -> None:
        """Follow until all robots that are not lost are done, and the coordinator is.

        Raises
        ------
        ChildDiedError
            If a process ends that the team cannot do without; or the last robot's.
        TeamTimeoutError
            If it takes too long.
        """
        while not is_done(self.there, self.recorder.statuses):
            self._step()
            self._check_time(self._unfinished())
        # Stopped, the coordinator has some seconds for what is left: so nothing may be.
        while left := self._to_come(session, team):
            self._step()
            self._check_time(left)

    def drain(self) -> None:
        """Take in what has arrived."""
        while (arrival := self.inbox.get(0.0)) is not None:
            for line in self.recorder.take(arrival):
                self._display.say(line)

    def _step(self) -> None:
        """Take in what arrives for a moment, show it, and look after the processes."""
        arrival = self.inbox.get(POLL)
        if arrival is not None:
            for line in self.recorder.take(arrival):
                self._display.say(line)
        self._display.update(self.recorder.statuses)
        self._look_after()

    def _look_after(self) -> None:
        """Tell who is lost; the others go on, and what the coordinator has of the robot stays."""
        self._crew.check()
        for error in self._crew.take_lost():
            self.lost += [robot for robot in self.there if agent_of(robot) == error.name]
            if not self.there:
                raise error
            self._display.say(f"{error}; the others go on")

    def _check_time(self, waiting_for: list[str]) -> None:
        if self._timeout is not None and self._end is not None and time.monotonic() > self._end:
            raise TeamTimeoutError(self._timeout, waiting_for)

    def _unfinished(self) -> list[str]:
        """Return who has not finished, or that comparing is what is left."""
        statuses = self.recorder.statuses.items()
        finished = {robot for robot, status in statuses if status.state == "finished"}
        return [r for r in self.there if r not in finished] or ["comparing the last maps"]

    def _to_come(self, session: zenoh.Session, team: str) -> list[str]:
        """Return what the coordinator has yet to get, or to make."""
        query = JointQuery(of="status")
        said = ask_for_what_is_valid(session, team, query, JointStatusMessage)
        return to_come(self.there, self.recorder.statuses, said)


def agent_of(robot: str) -> str:
    """Return the name of a robot's process."""
    return f"agent {robot}"
