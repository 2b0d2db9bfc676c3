"""Who belongs to a team, and in which role."""

from dataclasses import dataclass
from enum import Enum

from mapweave.ids import check_id


class Role(Enum):
    """What somebody is in a team."""

    ROUTER = "router"
    COORDINATOR = "coordinator"
    ROBOT = "robot"
    OPERATOR = "operator"
    VIEWER = "viewer"


@dataclass(frozen=True, slots=True)
class Member:
    """Somebody of a team.

    Attributes
    ----------
    team
        The team's id.
    role
        What it is.
    name
        Its id; that of its role for router and coordinator, of which there is one.
    """

    team: str
    role: Role
    name: str

    def __str__(self) -> str:
        alone = self.name == self.role.value
        return f"{self.role.value} {'' if alone else f'{self.name} '}of team {self.team}"

    @property
    def common_name(self) -> str:
        """What its certificate is made out to; no id has a dot, so none is another's."""
        return f"{self.team}.{self.role.value}.{self.name}"


@dataclass(frozen=True, slots=True)
class Roster:
    """A team's members.

    Raises
    ------
    InvalidIdError
        If a name is not an id.
    """

    team: str
    robots: tuple[str, ...] = ()
    operators: tuple[str, ...] = ()
    viewers: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        check_id("team", self.team)
        kinds = (("robot", self.robots), ("operator", self.operators), ("viewer", self.viewers))
        for kind, names in kinds:
            for name in names:
                check_id(kind, name)

    @property
    def members(self) -> tuple[Member, ...]:
        """All of them, router and coordinator first."""
        named = (
            (Role.ROUTER, ("router",)),
            (Role.COORDINATOR, ("coordinator",)),
            (Role.ROBOT, self.robots),
            (Role.OPERATOR, self.operators),
            (Role.VIEWER, self.viewers),
        )
        return tuple(Member(self.team, role, name) for role, names in named for name in names)

    def member(self, common_name: str) -> Member | None:
        """Return whose certificate is made out to `common_name`, None for a stranger's."""
        return next((each for each in self.members if each.common_name == common_name), None)
