"""All that can be asked for, in one place."""

from dataclasses import dataclass, field

from mapweave.config import Config
from mapweave_fusion_server.web.feed import Feed
from mapweave_fusion_server.web.history import History, to_json
from mapweave_fusion_server.web.parts import Paths
from mapweave_fusion_server.web.report import team_content
from mapweave_fusion_server.web.story import StoryTail


@dataclass(frozen=True, eq=False)
class Knowledge:
    """What the page and its programs are answered from.

    Attributes
    ----------
    team
        Its name.
    config
        The coordinator's.
    feed
        What the coordinator handed over last.
    history
        All versions.
    paths
        Those of the last versions.
    story
        The last lines of the journal.
    """

    team: str
    config: Config
    feed: Feed
    history: History
    story: StoryTail
    paths: Paths = field(default_factory=Paths)

    def team_json(self) -> bytes:
        """Return what ``/api/robots`` says."""
        seen = self.feed.seen
        robots = sorted({robot_map.robot for robot_map in seen.maps})
        return to_json(team_content(self.team, self.history.series, seen, robots))
