"""Who claims a name that one alone should have.

Counted by boot: a session hears its own token twice, and again whenever its link came back.
"""


def tell_coordinators(count: int) -> str:
    """Return the warning that a team has so many coordinators."""
    return f"{count} coordinators of the team are here, each with its own joint map: expected one"


def tell_robots(robot: str, count: int) -> str:
    """Return the warning that so many processes claim the id of a robot."""
    return f"{count} agents call themselves {robot}: expected one; give each robot an id of its own"


MOST = 64  # of one name: tokens cost those who hold them nothing


class Claimants:
    """Those that claim one name, such as a robot's id, or to be a team's coordinator."""

    def __init__(self) -> None:
        self.boots: set[str] = set()

    def take(self, boot: str, *, here: bool) -> int:
        """Note that one came or went; return how many there are if it is one too many, else 0."""
        known = boot in self.boots
        if not here:
            self.boots.discard(boot)
            return 0
        if not known and len(self.boots) >= MOST:
            return 0
        self.boots.add(boot)
        return 0 if known or len(self.boots) == 1 else len(self.boots)
