"""All that can be asked for, in one place."""

from dataclasses import dataclass, field

from mapweave.config import Config
from mapweave_fusion_server.web.feed import Feed, Seen
from mapweave_fusion_server.web.report import team_content
from mapweave_fusion_server.web.story import StoryTail
from mapweave_fusion_server.web.versions.history import History
from mapweave_fusion_server.web.versions.json_text import to_json
from mapweave_fusion_server.web.versions.paths import Paths
from mapweave_fusion_server.web.versions.searching import Searching


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
    searching
        What was searched, as it is found out.
    """

    team: str
    config: Config
    feed: Feed
    history: History
    story: StoryTail
    searching: Searching
    paths: Paths = field(default_factory=Paths)

    def take(self, seen: Seen) -> None:
        """Take what was handed over, if there is a version that is not here yet."""
        if seen.version > self.paths.latest:
            if seen.message is not None:
                self.history.take(seen.message)
            self.paths.keep(seen.version, seen.maps)

    def changes_json(self, number: int) -> bytes | None:
        """Return what makes the version before it version `number`, paths too; None if unknown."""
        changes = self.history.changes(number)
        before, paths = self.paths.of(number - 1), self.paths.of(number)
        if changes is None or before is None or paths is None:
            return None
        return b'{"paths":%s,%s' % (paths.json(before), changes[1:])

    def team_json(self) -> bytes:
        """Return what ``/api/robots`` says."""
        seen = self.feed.seen
        robots = sorted({robot_map.robot for robot_map in seen.maps})
        return to_json(team_content(self.team, self.history.series, seen, robots))
