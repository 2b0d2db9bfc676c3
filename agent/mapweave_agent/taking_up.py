"""What a new run of a robot takes up of its earlier ones: their maps, and numbers above theirs."""

import logging
import time
from pathlib import Path
from typing import NamedTuple, Self

import zenoh

from mapweave.maps import RobotMap
from mapweave_agent.past_runs import (
    PastRun,
    StateFolder,
    default_folder,
    first_component,
    young_enough,
)
from mapweave_protocol.errors import MessageError
from mapweave_protocol.link.asking import ask_robot_map
from mapweave_protocol.link.assembler import MapAssembler

RESUME_WITHIN = 3600.0  # [s] after its end that an earlier run still belongs to the team's map

_log = logging.getLogger(__name__)


class EarlierRuns(NamedTuple):
    """A robot's runs on disk, read before anybody hears of it.

    Attributes
    ----------
    folder
        Where they are, and where the new run is kept.
    runs
        The earliest first.
    """

    folder: StateFolder
    runs: list[PastRun]

    @classmethod
    def of(cls, team: str, robot: str, folder: Path | None) -> Self:
        """Read those of `robot` in `folder`, by default that of its team and name.

        Raises
        ------
        FileError
            If the folder cannot be read or made.
        """
        state = StateFolder(folder or default_folder(team, robot))
        return cls(state, state.runs(robot, time.time()))

    def young(self, within: float) -> list[PastRun]:
        """Return those that ended at most `within` [s] ago."""
        return young_enough(self.runs, within)

    def first_component(self, session: zenoh.Session | None, team: str, robot: str) -> int:
        """Return a component number above all known ones, here and at the coordinator.

        Without a session only those here are known; they are all, unless the disk is another one.
        """
        held = [] if session is None else _held(session, team, robot)
        return first_component([*(run.map for run in self.runs), *held])


def _held(session: zenoh.Session, team: str, robot: str) -> list[RobotMap]:
    """Return the map of the robot's last run that the coordinator holds, if there is one."""
    try:
        message = ask_robot_map(session, team, robot)
    except MessageError as error:
        _log.warning("answer ignored, %s", error)
        return []
    held = MapAssembler().update(message) if message is not None else None
    return [] if held is None else [held]
