"""Finished submaps until they are settled: the backend takes one at a time, tracking goes on.

A log gives the same map however long settling takes, as the mapper waits for an outcome at a
defined scan. A running robot waits for nothing: where its backend is late, finished submaps queue
for it as they are, and where tracking believes them to be is put right with each outcome.
"""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import takewhile

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.mapping.backend import BackendResult, BackendRunner, FinishedSubmap
from mapweave.mapping.map_snapshot import Unsettled, with_walls
from mapweave.maps import Submap

MOST_LATE = 64  # finished submaps that queue, minutes of driving; the growing one grows on then


@dataclass(frozen=True, slots=True, eq=False)
class Adopted:
    """Where everything is, now that one more submap is settled.

    Attributes
    ----------
    submaps
        All that are finished, ids from 0.
    newest_component
        The highest number of a component that the backend used; -1 where nothing came of it.
    moved
        (3,) of what was tracked on from it without a loss, component frame before to after; None
        where the last finished submap was not.
    is_held
        Whether all that had drifted until the last finished submap is taken back.
    """

    submaps: list[Submap]
    newest_component: int = -1
    moved: FloatArray | None = None
    is_held: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class _Late:
    """A finished submap as it was, and what draws its walls."""

    finished: FinishedSubmap
    walls: Unsettled


class SettlingQueue:
    """The last finished submaps, of which the first is with the backend.

    Parameters
    ----------
    backend
        Settles them, one at a time.
    live
        Whether nothing may wait for it.
    """

    def __init__(self, backend: BackendRunner, *, live: bool) -> None:
        self._backend = backend
        self._live = live
        self._late: deque[_Late] = deque()

    def __len__(self) -> int:
        return len(self._late)

    @property
    def walls(self) -> tuple[Unsettled, ...]:
        """What draws each of them."""
        return tuple(each.walls for each in self._late)

    @property
    def has_room(self) -> bool:
        """Whether another one can be taken without a wait."""
        return not self._live or len(self) < MOST_LATE or self._backend.is_ready

    def append(self, finished: FinishedSubmap) -> None:
        """Take the next one, as tracking left it."""
        self._late.append(_Late(finished, Unsettled(finished.growing)))
        if len(self) == 1:
            self._backend.begin(finished)

    def adopt(self, submaps: Sequence[Submap], *, wait: bool) -> Adopted | None:
        """Return what became of the first, which leaves; None without one, or where it is not done.

        Parameters
        ----------
        submaps
            All that are finished, where they are believed to be.
        wait
            Whether to wait for it, live too.
        """
        if not self._late or (self._live and not wait and not self._backend.is_ready):
            return None
        settled = self._backend.take()
        adopted = self._adopted(submaps, settled)
        self._late.popleft()
        if self._late:
            now = adopted.submaps[-len(self._late)]
            self._backend.begin(replace(self._late[0].finished, submap=now))
        return adopted

    def _adopted(self, submaps: Sequence[Submap], settled: BackendResult | None) -> Adopted:
        """Return where all are; what follows the settled one moves with the last scan before it."""
        first, *later = self._late
        count = len(submaps) - len(later)
        until, since = submaps[:count], submaps[count:]
        if settled is None:
            return Adopted([*with_walls(until, [first.walls]), *since])
        before, until = _end(until[-1]), settled.applied(until)
        moved = se2.compose(_end(until[-1]), se2.inverse(before))
        chain = len(list(takewhile(lambda each: each.finished.follows, later)))
        along = [
            replace(each, component=until[-1].component, pose=se2.compose(moved, each.pose))
            for each in since[:chain]
        ]
        return Adopted(
            _numbered([*until, *along, *since[chain:]]),
            settled.newest_component,
            moved if chain == len(later) else None,
            settled.is_held and not later,
        )


def _numbered(submaps: Sequence[Submap]) -> list[Submap]:
    """Return `submaps` with ids from 0: one may have been cut in two."""
    return [each if each.id == k else replace(each, id=k) for k, each in enumerate(submaps)]


def _end(submap: Submap) -> FloatArray:
    """(3,) the pose of a submap's last scan, component frame."""
    return se2.compose(submap.pose, submap.trajectory.pose[-1])
