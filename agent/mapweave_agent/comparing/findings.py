"""What a run finds out of its map and those of others: compared one by one, and told."""

import time
from collections.abc import Sequence

from mapweave.maps import Alignment, RobotMap
from mapweave_agent.comparing.outcomes import found_in, message_of
from mapweave_agent.comparison_schedule import ComparisonSchedule
from mapweave_agent.comparison_worker import ComparisonOutcome, ComparisonWorker
from mapweave_agent.live.whereabouts import Whereabouts
from mapweave_agent.needs import Needs
from mapweave_agent.outbox import Outbox
from mapweave_agent.own_map import OwnMap
from mapweave_agent.past_runs import StateFolder
from mapweave_agent.stored.team_place import TeamPlace
from mapweave_protocol.wire.messages import AlignmentMessage


class Findings:
    """Has maps compared, and publishes and keeps what comes of it.

    Parameters
    ----------
    own
        The map of the run.
    comparer
        Compares maps; it stays the caller's.
    comparisons
        Says which are due.
    outbox, needs, whereabouts, state
        Told what was found.
    """

    def __init__(
        self,
        own: OwnMap,
        comparer: ComparisonWorker,
        comparisons: ComparisonSchedule,
        outbox: Outbox,
        needs: Needs,
        whereabouts: Whereabouts,
        state: StateFolder,
    ) -> None:
        self._robot, self._boot = own.robot, own.boot
        self._place = None if own.known is None else TeamPlace(own.known)
        self._comparer = comparer
        self._comparisons = comparisons
        self._outbox = outbox
        self._needs = needs
        self._whereabouts = whereabouts
        self._state = state

    def compare(self, now: float, told: RobotMap) -> None:
        """Publish the outcome of the comparison under way, if there is one; begin the next.

        Parameters
        ----------
        now
            [s] by any clock.
        told
            The run's map as it was published last.
        """
        outcome = self._comparer.take()
        if outcome is not None:
            found = self._publish(outcome, told)
            self._comparisons.done(outcome.comparison, now, outcome.took, found)
        if not self._comparer.busy:
            comparison = self._comparisons.begin(now)
            if comparison is not None:
                ends = comparison.reference.robot, comparison.other.robot
                self._outbox.prepare_alignments(*ends)
                self._comparer.start(comparison)

    def tell_place(self, told: RobotMap) -> None:
        """Publish where the stored map that is followed lies in the team's, if that is news."""
        for message in self._place.news(told) if self._place is not None else ():
            self._tell(message, final=True)

    def _publish(self, outcome: ComparisonOutcome, told: RobotMap) -> Sequence[Alignment]:
        """Publish what was found, if it is news; return it, nothing where comparing failed."""
        comparison = outcome.comparison
        found = found_in(outcome, have_met=self._comparisons.have_met(comparison))
        if found is None:
            return ()
        if self._place is not None and self._place.is_about(comparison):
            self._place.take(comparison, found)
            self.tell_place(told)
            return found
        message = message_of(self._robot, comparison, found)
        self._tell(message, final=self._comparisons.is_final(comparison))
        return found

    def _tell(self, message: AlignmentMessage, *, final: bool) -> None:
        self._outbox.send_news(message, final=final)
        self._needs.published(time.monotonic(), message)
        self._whereabouts.met(message)
        self._state.keep_found(self._boot, self._outbox.found)
